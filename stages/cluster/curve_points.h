// A node's points, or centers of clusters of them, along the curve and as columns: what vector loops read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/dataset/normal_map.h"
#include "stages/cluster/reducer.h"

namespace cairn::stages {

/// All columns have one entry a point, or none.
struct CurvePoints {
  /// Lattice cells of the curve above its first point: near enough that nothing is lost however far from the world's
  /// origin the node is, and neither squares nor their sums leave the range of single precision.
  std::vector<double> x, y, z;
  std::vector<double> weight;     ///< empty: all 1
  std::vector<float> nx, ny, nz;  ///< unit, or zero for none; empty: the dataset has none

  std::size_t count() const { return x.size(); }
  bool has_normals() const { return !nx.empty(); }
  double weight_of(std::size_t i) const { return weight.empty() ? 1 : weight[i]; }
  formats::Normal normal_of(std::size_t i) const {
    return has_normals() ? formats::Normal{nx[i], ny[i], nz[i]} : formats::Normal{0, 0, 0};
  }
};

CurvePoints points_along_curve(const NodeView& node);

/// What the points along the curve are given, for each point of the node.
std::vector<std::uint32_t> by_point(const CurveOrder& curve,
                                    const std::vector<std::uint32_t>& along_curve);

}  // namespace cairn::stages
