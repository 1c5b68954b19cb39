// Where commands print their results.
#pragma once

#include <string_view>

namespace cairn::pipeline {

/// Writes to stdout at once. A reader that has gone (`cairn info ... | head`) is no error; throws kSystem for
/// all others.
void print_results(std::string_view text);
/// The same of a report for people, whose headings stand out on a terminal.
void print_report(std::string_view text);

}  // namespace cairn::pipeline
