// Voxel grids, as other systems use them, for comparison: the points of a cell become their mean.
// Based on: M. Schuetz, B. Kerbl, P. Klaus, M. Wimmer, "GPU-Accelerated LOD Generation for Point Clouds", 2023, sections 4.2.3
// (average) and 4.2.4 (weighted). Where it departs: positions are the means of a cell's points, not its center; and cells
// are as wide as gives the number of representatives that is asked for, the fullest ones being cut along the curve.
#pragma once

#include "stages/cluster/reducer.h"

namespace cairn::stages {

class GridReducer final : public Reducer {
 public:
  enum class Filter {
    kCell,   ///< attributes are means over the points of a cell
    kReach,  ///< over all points within a cell's width of its center, the nearer the more (section 4.2.4: 1 - distance)
  };

  explicit GridReducer(Filter filter) : filter_(filter) {}

  std::string_view name() const override {
    return filter_ == Filter::kCell ? "average" : "weighted";
  }
  bool exact_count() const override { return true; }
  Reduction reduce(const NodeView& node, std::uint64_t quota) const override;

 private:
  Filter filter_;
};

}  // namespace cairn::stages
