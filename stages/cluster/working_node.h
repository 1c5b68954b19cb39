// A node while it is being clustered: its points as they will be stored, and beside them the exact sums
// over input points from which means and errors follow.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/dataset/node_data.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/normal_map.h"
#include "formats/dataset/numerics.h"
#include "formats/wide_int.h"

namespace cairn::stages {

/// Unit normals are summed as integers of this many units.
inline constexpr double kNormalUnits = 32768;

using Steps = std::array<std::int64_t, 3>;

/// The points of a node, or of one child's share of it. At leaves the vectors marked (*) are empty: each
/// point is its own only input point.
struct WorkingNode {
  formats::NodeData data;
  std::vector<formats::Normal> normal;  ///< unit, or zero for none; empty: the dataset has none

  std::vector<Steps>
      residual;  ///< (*) sum over a point's input points of (input - position), in steps: exact
  std::vector<double>
      bound;  ///< (*) world units: no input point of this point is farther from it; rounded up
  std::vector<double>
      reach;  ///< (*) world units: how far the spheres that it stands for reach from it
  std::vector<Steps>
      normal_sum;  ///< (*) sum over input points of their normals, kNormalUnits each; empty: no normals
  /// (*) for each attribute with rule kMean the sums over input points, components interleaved. Sums of
  /// integers are exact below 2^53.
  std::vector<std::vector<double>> mean_sum;

  /// Sum over all input points of the squared distance to their point here, in steps, per axis: exact.
  std::array<formats::Uint128, 3> squared_steps{};
  formats::GridBox box;  ///< tight box of all points below
  std::uint64_t weight = 0;
  formats::Digest digest;
  float theta = 0;  ///< of the merging that made these points
  std::uint32_t grid = 0;
  formats::Numerics numerics;  ///< of that merging; nothing of quantisation yet

  std::size_t count() const { return data.count(); }
  std::uint64_t weight_of(std::size_t i) const { return data.weight.empty() ? 1 : data.weight[i]; }
};

}  // namespace cairn::stages
