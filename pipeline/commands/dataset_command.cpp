#include "pipeline/commands/dataset_command.h"

#include <CLI/CLI.hpp>

namespace cairn::pipeline {

DatasetCommand::DatasetCommand(CLI::App& program, const char* name, const char* about,
                               const char* footer)
    : parser_(*program.add_subcommand(name, about)) {
  parser_.footer(footer);
  parser_.add_option("dataset", dataset_, "the dataset, a folder")
      ->option_text("NAME.cairn")
      ->required();
}

}  // namespace cairn::pipeline
