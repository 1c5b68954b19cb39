// The interface of all reducers: how a node's points become the fewer representatives that stand for
// them in its parent.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/dataset/grid.h"
#include "formats/dataset/normal_map.h"
#include "formats/dataset/tree.h"
#include "stages/cluster/curve_order.h"
#include "stages/cluster/pair_merge.h"

namespace cairn::stages {

/// A node's points as a reducer sees them. All spans have one entry a point, or none.
struct NodeView {
  formats::NodeId id{};
  const formats::Grid& grid;
  std::span<const formats::GridPoint> position;
  std::span<const std::uint64_t> weight;    ///< empty: all 1
  std::span<const formats::Normal> normal;  ///< unit, or zero for none; empty: the dataset has none
  std::span<const float> radius;            ///< world units, not negative
  const CurveOrder& curve;
};

struct Share {
  std::uint32_t point;
  double factor;  ///< by which its weight counts; above 0
};

struct Reduction {
  /// For each point the representative that stands for it. Representatives are numbered along the
  /// curve, by their first point; each stands for at least one.
  std::vector<std::uint32_t> representative;
  /// For each representative the point whose values it takes; empty: it is the mean of its points.
  std::vector<std::uint32_t> chosen;
  /// For each representative the shares of points, also of some that it does not stand for, in its attributes that are
  /// averaged. Where there are none, its own points have one share each.
  std::vector<std::vector<Share>> blend;
  float theta_degrees =
      0;  ///< largest threshold that merging was relaxed to; 0 if normals played no part
  std::uint32_t grid =
      0;  ///< cells along the longest axis of the coarsest grid used; 0 if none was
  bool theta_relaxed = false;   ///< beyond its setting
  bool grid_coarsened = false;  ///< from the one that merging began on
};

class Reducer {
 public:
  virtual ~Reducer() = default;
  virtual std::string_view name() const = 0;
  /// Whether reduce() gives exactly `quota` representatives, as uniform nodes need.
  virtual bool exact_count() const = 0;
  /// Requires 1 <= quota <= points. A pure function of its arguments; called by several threads.
  virtual Reduction reduce(const NodeView& node, std::uint64_t quota) const = 0;
};

struct ClusterOptions {
  std::optional<std::uint32_t> grid;  ///< K, 1 to 65536; none: about 16 points a cell
  ThetaRule theta;
  std::uint32_t refinement = 2;  ///< passes in which points move to the nearest center
};

/// The names of all reducers, the default first.
std::span<const std::string_view> reducer_names();
/// Throws Error (kUsage) for any other name. `options` serve "cluster".
std::unique_ptr<Reducer> make_reducer(std::string_view name, const ClusterOptions& options);

}  // namespace cairn::stages
