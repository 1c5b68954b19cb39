// How a failure is told: one line on stderr and an exit code; and what is no failure but worth a line.
#pragma once

#include <string>

#include "formats/error.h"

namespace cairn::pipeline {

/// Prints `cairn: error: TEXT` as one line, whatever the text holds, and hands the exit code back.
int fail(std::string text, formats::ErrorKind kind);

/// The same for the exception in flight. `where`, if any, goes before its text.
int report_failure(const std::string& where = {});

/// Prints `cairn: note: TEXT` as one line: nothing has failed.
void tell_note(std::string text);

}  // namespace cairn::pipeline
