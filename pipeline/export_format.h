// What a dataset can be exported as. A further format is a line of the table in export_format.cpp and a file that writes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/export.h"

namespace cairn::pipeline {

struct ExportJob {
  const stages::Context& context;
  const formats::DatasetReader& dataset;
  const stages::ExportSelection& selection;  ///< everything, of a format that does not take parts
  const std::filesystem::path& output;
  bool force = false;  ///< replace what stands there
};

struct ExportFormat {
  std::string_view name;                       ///< as --format takes it
  std::span<const std::string_view> suffixes;  ///< of outputs that are taken for it, in lower case
  bool takes_parts =
      true;  ///< a level, a box, a cut on a budget; else the leaves with all above them
  bool makes_folder = false;  ///< else a file
  /// Writes the job's points, publishes them in one step and returns how many they are.
  std::uint64_t (*write)(const ExportFormat& format, const ExportJob& job) = nullptr;
};

std::span<const ExportFormat> export_formats();

/// The format of this name, or if it is empty the one that the suffix of `output` tells. Throws Error (kUsage).
const ExportFormat& export_format(const std::string& name, const std::filesystem::path& output);

/// "las, ply or xyz", for help and messages.
std::string export_format_names();

/// Writes one of formats::scan_formats. Throws Error (kUsage) where no point is selected: a scan without any is of no use
/// and not taken by most programs.
std::uint64_t export_scan(const ExportFormat& format, const ExportJob& job);

}  // namespace cairn::pipeline
