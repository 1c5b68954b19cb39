// Export: one level of a dataset, or its leaves, streamed into a scan of a common format.
#pragma once

#include <cstdint>

#include "formats/dataset/dataset_reader.h"
#include "formats/scans/scan_writer.h"
#include "stages/context.h"

namespace cairn::stages {

/// Name of the attribute by which inner levels tell how many input points a point stands for; with as
/// many underscores behind it as make it unlike all attributes of the input.
inline constexpr std::string_view kWeightAttribute = "weight";

/// How a level is told as a scan: schema, encoding and coordinate system.
/// Leaves have the input's attributes; inner levels have those that representatives carry, and `radius`
/// and `weight`. With `steps` positions stay whole numbers: steps of the grid counted from its own
/// offset, so that what came from LAS gets its integers back; where these do not fit int32, steps from a
/// shifted offset, which is exact wherever a double can hold that. Else they are world coordinates.
/// Throws Error: kUsage for a level that the dataset has not, kInput for metadata without its CRS records.
formats::ScanInfo describe_export(const formats::DatasetReader& dataset, formats::Level level,
                                  bool steps);

/// Writes the points of a level in the order of their nodes and returns how many. `description` is what
/// describe_export gave for it and the writer was created with; the writer is left for the caller to finish.
/// Memory: one node. Throws what the reader and the writer throw.
std::uint64_t export_level(const Context& context, const formats::DatasetReader& dataset,
                           formats::Level level, const formats::ScanInfo& description,
                           formats::ScanWriter& writer);

}  // namespace cairn::stages
