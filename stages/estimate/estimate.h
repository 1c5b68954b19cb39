// Estimate: normals and radii from the nearest neighbours of every point, leaf by leaf, between split and
// cluster; only what is asked for. Neighbours are distinct positions of the whole cloud, found exactly, so
// what is estimated does not depend on how the points are divided into leaves.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/dataset/grid.h"
#include "formats/dataset/tree.h"
#include "stages/context.h"

namespace cairn::stages {

struct EstimateOptions {
  bool normals = false;
  bool radii = false;
  std::uint32_t neighbors = 16;  ///< k: distinct positions, the point's own included; at least 3
};

struct EstimateInput {
  /// May be empty where an earlier run was done with them. All records in kd-order, `stride` bytes each: 12-byte grid position, attributes, then, if `numbered`,
  /// the number of the record's scan as a u32.
  formats::ExternalArray& records;
  std::size_t stride;
  bool numbered;
  const formats::Grid& grid;
  const formats::Tree& tree;
  /// Where the sensor of each scan stood, in the world, as far as that is known. Records that are not
  /// numbered are all of the first scan.
  std::span<const std::optional<formats::WorldPoint>> sensors;
};

/// The records with what was estimated in place of the scan's number: a float32 x 3 normal (unit, or zero
/// where there is none), then a float32 radius (world units), of these what was asked for.
struct EstimatedPoints {
  formats::ExternalArray array;
  std::size_t stride = 0;
};

/// Bytes of a record after `estimate`.
std::size_t estimated_stride(std::size_t stride, bool numbered, const EstimateOptions& options);

/// Leaves the input as it is: no record is lost if it fails.
EstimatedPoints estimate(const EstimateInput& input, const EstimateOptions& options,
                         Context& context);

}  // namespace cairn::stages
