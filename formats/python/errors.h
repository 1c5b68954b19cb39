// How an Error of the reader reaches Python: as an exception of the package cairn; and how Python ends what waits.
#pragma once

namespace cairn::formats::python {

/// From here on Errors that leave this module are raised as what cairn._errors.exception_of makes of them; Stopped as what
/// a signal raised, or KeyboardInterrupt.
void register_errors();

/// Runs Python's handlers of the signals that have come, which it does in its main thread alone. Returns whether one of them
/// raised an exception, as that of Ctrl-C does: it is set then, and whoever waits is to end by Stopped. Takes the
/// interpreter's lock.
bool has_raising_signal();

}  // namespace cairn::formats::python
