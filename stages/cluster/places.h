// Where a node's points lie, as doubles in world units from its first point: near enough that nothing is lost however far
// from the world's origin the node is.
#pragma once

#include <array>
#include <cstddef>

#include "stages/cluster/reducer.h"

namespace cairn::stages {

using Location = std::array<double, 3>;

inline double squared_distance(const Location& a, const Location& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

class Places {
 public:
  explicit Places(const NodeView& node) : node_(node) {}

  Location operator[](std::size_t point) const {
    const formats::GridPoint &origin = node_.position[0], &at = node_.position[point];
    Location place;
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] =
          static_cast<double>(std::int64_t{at[axis]} - origin[axis]) * node_.grid.step[axis];
    return place;
  }

 private:
  const NodeView& node_;
};

}  // namespace cairn::stages
