// Export: points of a dataset (a level, its leaves, a mixed cut), streamed into a scan of a common format.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/scans/scan_writer.h"
#include "stages/context.h"

namespace cairn::stages {

/// Name of the attribute by which inner levels tell how many input points a point stands for; with as
/// many underscores behind it as make it unlike all attributes of the input.
inline constexpr std::string_view kWeightAttribute = "weight";

/// World coordinates, both ends included.
struct WorldBox {
  formats::WorldPoint min{};
  formats::WorldPoint max{};

  bool contains(const formats::WorldPoint& p) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!(p[axis] >= min[axis] && p[axis] <= max[axis])) return false;
    return true;
  }
};

/// Some blocks of a node: bit b stands for block b (of a leaf there is block 0 alone).
struct ExportedNode {
  formats::NodeId node{};
  std::uint64_t blocks = 0;
};

/// What is exported: blocks of nodes, of these the points inside the box, if there is one.
struct ExportSelection {
  std::vector<ExportedNode> nodes;  ///< in the order of the exported points
  std::optional<WorldBox> box;
};

/// All points of a level, or those inside the box; nodes that lie outside of it are left out. Throws Error (kUsage) for a
/// level that the dataset has not.
ExportSelection level_selection(const formats::DatasetReader& dataset, formats::Level level,
                                std::optional<WorldBox> box = {});

/// How a selection is told as a scan: schema, encoding, coordinate system, and at most how many points.
/// Leaves have the input's attributes; where inner nodes take part, all points have those that representatives carry,
/// and `radius` and `weight` (1 in leaves). With `steps` positions stay whole numbers: steps of the grid counted from its
/// own offset, so that what came from LAS gets its integers back; where these do not fit int32, steps from a
/// shifted offset, which is exact wherever a double can hold that. Else they are world coordinates.
/// Throws Error (kInput) for metadata without its CRS records.
formats::ScanInfo describe_export(const formats::DatasetReader& dataset,
                                  const ExportSelection& selection, bool steps);

/// Names of the input's attributes that the selection leaves out, as only leaves carry them.
std::vector<std::string> left_out_attributes(const formats::DatasetReader& dataset,
                                             const ExportSelection& selection);

/// Writes the points of a selection in the order of its nodes and returns how many. `description` is what
/// describe_export gave for it and the writer was created with; the writer is left for the caller to finish.
/// Memory: one node. Throws what the reader and the writer throw.
std::uint64_t export_points(const Context& context, const formats::DatasetReader& dataset,
                            const ExportSelection& selection, const formats::ScanInfo& description,
                            formats::ScanWriter& writer);

}  // namespace cairn::stages
