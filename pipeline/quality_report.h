// The report of a dataset: how uniform its nodes are, what was lost on the way from the scans and why, how large
// the errors are, what the bytes go to, and what the build cost.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/build_report.h"

namespace cairn::pipeline {

/// As aligned tables. `run` is what run.json tells, if it is there. Throws Error (kInput) where the metadata lacks what
/// its format demands.
std::string quality_text(const formats::DatasetReader& dataset, const std::filesystem::path& folder,
                         const std::optional<BuildReport>& run);

/// The same as one JSON object, with the histogram of node sizes of every level.
std::string quality_json(const formats::DatasetReader& dataset, const std::filesystem::path& folder,
                         const std::optional<BuildReport>& run);

}  // namespace cairn::pipeline
