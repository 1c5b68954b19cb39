// How far boxes of grid points are from each other and from a point: what searches through a tree prune by.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "formats/dataset/grid.h"

namespace cairn::stages {

/// Squared world distance between two boxes, and between a position and a box; 0 where they meet. As
/// every step of formats::squared_distance is monotone, neither is above the rounded distance of any two
/// positions inside.
inline double squared_distance(const std::array<double, 3>& step, const formats::GridBox& a,
                               const formats::GridBox& b) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t gap = std::max({std::int64_t{0}, std::int64_t{a.min[axis]} - b.max[axis],
                                       std::int64_t{b.min[axis]} - a.max[axis]});
    const double d = step[axis] * static_cast<double>(gap);
    sum += d * d;
  }
  return sum;
}
inline double squared_distance(const std::array<double, 3>& step, const formats::GridPoint& p,
                               const formats::GridBox& box) {
  return squared_distance(step, formats::GridBox{p, p}, box);
}

}  // namespace cairn::stages
