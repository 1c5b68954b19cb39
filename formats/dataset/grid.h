// The one integer grid of a dataset: positions are int32 steps, world = offset + step * (i + shift).
// From here on splitting compares integers and averages are integer sums, so results depend neither on
// the order of summation nor on where the scans lie (UTM, Earth-centred).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace cairn::formats {

using GridPoint = std::array<std::int32_t, 3>;
using WorldPoint = std::array<double, 3>;

struct Grid {
  std::array<double, 3> step{1, 1, 1};         ///< world units a step; finite, > 0
  std::array<double, 3> offset{0, 0, 0};       ///< world units
  std::array<std::int64_t, 3> shift{0, 0, 0};  ///< steps

  double world(int axis, std::int32_t i) const {
    return offset[axis] +
           step[axis] * static_cast<double>(static_cast<std::int64_t>(i) + shift[axis]);
  }
  WorldPoint world(const GridPoint& p) const {
    return {world(0, p[0]), world(1, p[1]), world(2, p[2])};
  }

  friend bool operator==(const Grid&, const Grid&) = default;
};

/// An axis-aligned box of grid points, both ends included; empty while min > max.
struct GridBox {
  GridPoint min{INT32_MAX, INT32_MAX, INT32_MAX};
  GridPoint max{INT32_MIN, INT32_MIN, INT32_MIN};

  bool empty() const { return min[0] > max[0]; }
  /// Steps between the ends of an axis; 0 for one plane.
  std::uint32_t span(int axis) const {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(max[axis]) - min[axis]);
  }
  void add(const GridPoint& p) {
    for (int a = 0; a < 3; ++a) {
      if (p[a] < min[a]) min[a] = p[a];
      if (p[a] > max[a]) max[a] = p[a];
    }
  }
  void add(const GridBox& other) {
    if (other.empty()) return;
    add(other.min);
    add(other.max);
  }
  bool contains(const GridPoint& p) const {
    for (int a = 0; a < 3; ++a)
      if (p[a] < min[a] || p[a] > max[a]) return false;
    return true;
  }
  bool contains(const GridBox& other) const {
    return other.empty() || (contains(other.min) && contains(other.max));
  }

  friend bool operator==(const GridBox&, const GridBox&) = default;
};

/// The tight box of points.
inline GridBox box_of(std::span<const GridPoint> points) {
  auto [low, high] = GridBox{};
  for (const GridPoint& p : points)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  return {low, high};
}

/// Squared world distance between two grid points. The differences are exact; the rest is rounded to
/// nearest, so the result carries a relative error below 2^-50.
inline double squared_distance(const Grid& grid, const GridPoint& a, const GridPoint& b) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d =
        grid.step[axis] * static_cast<double>(static_cast<std::int64_t>(a[axis]) - b[axis]);
    sum += d * d;
  }
  return sum;
}

}  // namespace cairn::formats
