// Exact selection: the coordinates at given ranks of a node's points along one axis, by histograms of
// the leading bits and then of the next bits inside the boundary bins. The points are read, not moved,
// and memory does not grow with their number.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/split/record_source.h"

namespace cairn::stages {

/// A coordinate, as steps above the node's smallest, at which children meet.
struct Boundary {
  std::uint32_t key = 0;
  std::uint64_t less = 0;  ///< points of the node with a smaller key
};

/// For each rank (ascending, each below the number of points) the key of the point that would stand
/// there if the points were sorted along `axis`. `low` is the node's smallest coordinate on the axis,
/// `span` its extent.
std::vector<Boundary> select_ranks(std::span<const Slab> slabs, std::size_t axis, std::int32_t low,
                                   std::uint32_t span, std::span<const std::uint64_t> ranks,
                                   const PassMode& mode);

}  // namespace cairn::stages
