// A dataset, and the build that made it, as people and programs are told of them.
#pragma once

#include <filesystem>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/build_report.h"

namespace cairn::pipeline {

/// One JSON object: the dataset's metadata, with the sizes of all files in "bytes".
std::string dataset_json(const formats::DatasetReader& dataset);

/// The same as aligned lines: points, attributes, bounds, tree, sizes, and a table of the levels. Throws Error (kInput)
/// where the metadata lacks what its format demands.
std::string dataset_text(const formats::DatasetReader& dataset,
                         const std::filesystem::path& folder);

/// Throws that Error, of the dataset in `folder`.
[[noreturn]] void refuse_metadata(const std::filesystem::path& folder, const std::string& found);

/// A table of the stages, with the whole build and its memory. `points` are those kept.
std::string build_text(const BuildReport& report, std::uint64_t points);

}  // namespace cairn::pipeline
