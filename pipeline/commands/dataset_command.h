// What the commands that read a dataset have in common.
#pragma once

#include <string>

#include "pipeline/commands/command.h"

namespace cairn::pipeline {

class DatasetCommand : public Command {
 public:
  /// Adds a subcommand whose first argument names the dataset.
  DatasetCommand(CLI::App& program, const char* name, const char* about, const char* footer);

  CLI::App& parser() override { return parser_; }

 protected:
  CLI::App& parser_;
  std::string dataset_;
};

}  // namespace cairn::pipeline
