// The scans of a dataset as `verify` and `measure` take them: files, or a configuration file that names them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/commands/setting_flags.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

class AgainstFlags {
 public:
  /// Adds --against, with its help, and what a build must know of its scans beside their files. Must outlive the
  /// parser.
  AgainstFlags(CLI::App& parser, const char* help);

  /// None if none are given. Throws Error: kUsage for flags that do not fit together, and as open_campaign does.
  stages::Scans open() const;

 private:
  std::vector<std::string> against_;
  std::vector<Flag> flags_;
};

/// The scans' points as records of the dataset, balanced as they are there; nothing if there are no scans. All
/// arguments must outlive it.
std::optional<stages::RecordSource> source_of(const stages::Scans& scans,
                                              const formats::DatasetReader& dataset,
                                              const stages::Context& context);

}  // namespace cairn::pipeline
