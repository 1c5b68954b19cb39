// Measure: what a coarse level costs in accuracy. Each leaf point is compared with the one that stands for it on each
// level: none is left out, nothing is estimated. What takes a search (the nearest representative, covering splats, even
// spacing) is measured of a sample, or of all points.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/measure/geometry_error.h"
#include "stages/record_stream.h"

namespace cairn::stages {

struct MeasureOptions {
  /// About how many points are measured where that takes a search: leaf points in all, stored points on each level. 0:
  /// none; kAllPoints: all of them.
  std::uint64_t sample = 200'000;
  static constexpr std::uint64_t kAllPoints = UINT64_MAX;
  /// If given, the points that are searched for are taken from the scans themselves, not from the leaves.
  std::optional<RecordSource> against;
  /// If given, the distance of a place from the true surface, in world units. Called from any thread.
  std::function<double(const formats::WorldPoint&)> true_distance;
};

/// How far the values of leaf points are from those of the points that stand for them.
struct AttributeError {
  std::string name;
  std::string unit;            ///< "degrees" for normals, else empty: the attribute's own
  std::uint64_t compared = 0;  ///< values: directions of points, or single components
  double rms = 0;
  double largest = 0;
};

/// Lengths in world units. Distances are those of leaf points from the points that stand for them, both as they are
/// stored.
struct LevelError {
  formats::Level level = 0;
  std::uint64_t nodes = 0;
  std::uint64_t points = 0;  ///< stored on the level
  double rms = 0;
  double percentile_99 = 0;  ///< rounded up by at most 0.2 %
  double largest = 0;
  double bound = 0;                        ///< the largest that a node of the level records
  std::uint64_t broken_bounds = 0;         ///< nodes in which a point is farther off than recorded
  std::vector<AttributeError> attributes;  ///< those that are averaged, in the order of the schema
  double cover_factor = 1;                 ///< the largest that a node of the level records
  GeometryError geometry;
};

struct ErrorReport {
  std::uint64_t leaf_points = 0;
  double leaf_displacement =
      0;  ///< no leaf point is stored farther than this from its input, on the grid
  std::vector<LevelError> levels;  ///< all but the leaves', from the root down
  GeometryError leaves;            ///< `surface` only against scans

  bool held() const;
};

/// Memory: for each thread a path of decoded nodes from the root to a leaf, a cache of splats of a quarter of the context's,
/// and the sample of scans. Throws Error: kInput where bytes are damaged, kSystem where reading fails; and Stopped.
ErrorReport measure_dataset(const Context& context, const formats::DatasetReader& dataset,
                            const MeasureOptions& options);

}  // namespace cairn::stages
