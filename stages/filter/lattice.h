// A lattice of cubic cells in the world. Its planes go through the offset of the dataset's grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "formats/dataset/grid.h"
#include "stages/filter/cell_region.h"

namespace cairn::stages {

class Lattice {
 public:
  /// `side`, in world units, is made a grid step where it is shorter.
  Lattice(const formats::Grid& grid, double side) : grid_(grid) {
    for (std::size_t axis = 0; axis < 3; ++axis) side_[axis] = std::max(side, grid.step[axis]);
  }

  /// Every step is monotone, so that cells are intervals.
  std::int64_t cell_of(std::size_t axis, std::int32_t coordinate) const {
    return static_cast<std::int64_t>(std::floor(from_offset(axis, coordinate) / side_[axis]));
  }
  Cell cell_at(const formats::GridPoint& p) const {
    return {cell_of(0, p[0]), cell_of(1, p[1]), cell_of(2, p[2])};
  }

  double squared_distance_to_center(const formats::GridPoint& p, const Cell& cell) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double center = (static_cast<double>(cell[axis]) + 0.5) * side_[axis];
      const double d = from_offset(axis, p[axis]) - center;
      sum += d * d;
    }
    return sum;
  }

 private:
  double from_offset(std::size_t axis, std::int32_t coordinate) const {
    return grid_.step[axis] * static_cast<double>(coordinate + grid_.shift[axis]);
  }

  const formats::Grid& grid_;
  std::array<double, 3> side_;
};

}  // namespace cairn::stages
