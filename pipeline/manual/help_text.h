// What --help prints.
#pragma once

#include <string>
#include <vector>

#include "pipeline/manual/manual.h"
#include "pipeline/terminal.h"

namespace cairn::pipeline {

/// The help of a command, or of the program with its commands, filled to so many columns (40 at least; words that are
/// longer stand out).
std::string help_text(const CommandText& command, const std::vector<CommandText>& commands,
                      unsigned columns, const Paint& paint);

/// The columns that help is to have: those of COLUMNS or of the terminal, 80 elsewhere, and no more than are easily read.
unsigned help_columns();

}  // namespace cairn::pipeline
