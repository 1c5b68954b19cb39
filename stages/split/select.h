// Exact selection: the coordinates at given ranks of a node's points along one axis, by a histogram of the leading bits;
// what lies in the bins of the ranks is then sorted, or, if it is too much, told apart by more bits. The points are read,
// not moved; of each slab a histogram is kept.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/split/record_source.h"

namespace cairn::stages {

/// A coordinate, as steps above the node's smallest, at which children meet.
struct Boundary {
  std::uint32_t key = 0;
  std::uint64_t less = 0;   ///< points with a smaller key
  std::uint64_t equal = 0;  ///< points with this key
};

struct Selection {
  std::vector<Boundary> boundaries;  ///< of the node: a rank
  std::vector<std::vector<Boundary>>
      slabs;  ///< for each slab the same boundaries, with its own points alone
};

/// For each rank (ascending, each below the number of points) the key of the point that would stand
/// there if the points were sorted along `axis`. `low` is the node's smallest coordinate on the axis,
/// `span` its extent. Of the keys that share leading bits with one at a rank, at most `most_collected` are kept in memory.
Selection select_ranks(std::span<const Slab> slabs, std::size_t axis, std::int32_t low,
                       std::uint32_t span, std::span<const std::uint64_t> ranks,
                       const PassMode& mode, std::uint64_t most_collected = std::uint64_t{1} << 20);

}  // namespace cairn::stages
