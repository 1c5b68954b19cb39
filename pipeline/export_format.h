// What a dataset can be exported as: any scan that formats/ can write, and 3D Tiles.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "formats/dataset/dataset_reader.h"
#include "formats/scans/scan_writer.h"
#include "stages/context.h"
#include "stages/export.h"

namespace cairn::pipeline {

/// All levels as a folder for web clients; no suffix tells it.
inline constexpr std::string_view kTilesFormat = "3dtiles";

struct ScanExport {
  const stages::Context& context;
  const formats::DatasetReader& dataset;
  const stages::ExportSelection& selection;
  const std::filesystem::path& output;
  bool force = false;  ///< replace what stands there
};

/// The format of this name, or if it is empty the one that the suffix of `output` tells. Throws Error (kUsage).
const formats::ScanFormat& export_format(const std::string& name,
                                         const std::filesystem::path& output);

/// "las, ply, xyz or 3dtiles", for help and messages.
std::string export_format_names();

/// Writes the selected points, publishes them in one step and returns how many they are. Throws Error (kUsage) where no
/// point is selected: a scan without any is of no use and not taken by most programs.
std::uint64_t export_scan(const formats::ScanFormat& format, const ScanExport& job);

}  // namespace cairn::pipeline
