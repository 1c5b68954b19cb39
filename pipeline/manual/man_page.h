// The manual page of the program.
#pragma once

#include <string>
#include <string_view>

#include "pipeline/manual/manual.h"

namespace cairn::pipeline {

/// cairn(1), a section for every command, in the macros of man(7). Tells no date, so that the same program gives the
/// same page.
std::string man_page(const ProgramText& text, std::string_view version);

}  // namespace cairn::pipeline
