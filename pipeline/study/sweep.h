// The settings of a study: the product of [sweep], and each [[setting]], over [settings].
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "pipeline/checked_table.h"
#include "pipeline/study/study_file.h"

namespace cairn::pipeline {

/// Tables of a study file, as far as they are there.
struct SweepTables {
  const toml::table* fixed = nullptr;  ///< [settings]
  const toml::table* swept = nullptr;  ///< [sweep]: arrays of values
  Tables single;  ///< [[setting]]: each with its own values, and perhaps a name
};

/// First the product, its last key varying fastest (keys in the order of the table of settings), then the single ones;
/// the fixed settings alone if there is neither. Throws kUsage as parse_study does.
std::vector<StudySetting> expand_sweep(const SweepTables& tables,
                                       const std::filesystem::path& file);

}  // namespace cairn::pipeline
