// How an Error of the reader reaches Python: as an exception of the package cairn.
#pragma once

namespace cairn::formats::python {

/// From here on Errors that leave this module are raised as what cairn._errors.exception_of makes of them.
void register_errors();

}  // namespace cairn::formats::python
