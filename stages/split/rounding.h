// How far positions were moved when they became steps of the dataset's grid: largest and RMS, the same in any order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "formats/dataset/grid.h"
#include "formats/wide_int.h"

namespace cairn::stages {

class Rounding {
 public:
  /// `steps`: what was rounded off on each axis, in grid steps.
  void add(const std::array<double, 3>& steps, const std::array<double, 3>& step) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double moved = step[axis] * steps[axis];
      squared += moved * moved;
      const auto units = static_cast<std::int64_t>(steps[axis] * kUnits);
      squares_[axis] += static_cast<formats::Uint128>(units * units);
    }
    largest_squared_ = std::max(largest_squared_, squared);
  }
  void add(const Rounding& other) {
    largest_squared_ = std::max(largest_squared_, other.largest_squared_);
    for (std::size_t axis = 0; axis < 3; ++axis) squares_[axis] += other.squares_[axis];
  }

  /// The largest distance, world units.
  double largest() const { return std::sqrt(largest_squared_); }
  /// Over `points` points, world units.
  double rms(std::uint64_t points, const std::array<double, 3>& step) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double unit = step[axis] / kUnits;
      sum += static_cast<double>(squares_[axis]) * unit * unit;
    }
    return points > 0 ? std::sqrt(sum / static_cast<double>(points)) : 0;
  }

 private:
  /// A step in units: their squares are added up as integers, so that the order of points does not matter.
  static constexpr double kUnits = 1 << 20;

  double largest_squared_ = 0;
  std::array<formats::Uint128, 3> squares_{};
};

}  // namespace cairn::stages
