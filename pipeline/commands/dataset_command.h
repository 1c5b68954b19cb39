// What the commands that read a dataset have in common.
#pragma once

#include <stop_token>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/commands/command.h"

namespace cairn::pipeline {

class DatasetCommand : public Command {
 public:
  /// Adds a subcommand whose first argument names the dataset.
  DatasetCommand(CLI::App& program, const char* name, const char* about, const char* footer);

  CLI::App& parser() override { return parser_; }

 protected:
  /// Opens it. Throws as DatasetReader::open does, and Error (kUsage) for flags of the cache that cannot be.
  formats::DatasetReader open_dataset(const std::stop_token& stop) const;

  CLI::App& parser_;
  std::string dataset_;

 private:
  std::string web_cache_;
  std::string web_cache_size_ = "1GiB";
};

}  // namespace cairn::pipeline
