// What shells source to complete the program's command line. No shell's own library is needed but zsh's and fish's.
#pragma once

#include <string>

#include "pipeline/manual/manual.h"

namespace cairn::pipeline {

std::string bash_completion(const ProgramText& text);
std::string zsh_completion(const ProgramText& text);
std::string fish_completion(const ProgramText& text);

}  // namespace cairn::pipeline
