// Which cells of a lattice a node of the tree has for itself. Leaves meet at planes, so the points of one cell may lie
// in many leaves; but what lies between the planes around a node lies in no other.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "formats/dataset/grid.h"
#include "formats/dataset/tree.h"

namespace cairn::stages {

using Cell = std::array<std::int64_t, 3>;

/// The number of the cell that a coordinate falls into; never less for a greater coordinate.
using CellOf = std::function<std::int64_t(std::size_t axis, std::int32_t coordinate)>;

/// The cells between `above` and `below`, both left out.
struct CellRegion {
  static constexpr std::int64_t kLowest = std::numeric_limits<std::int64_t>::min();
  static constexpr std::int64_t kHighest = std::numeric_limits<std::int64_t>::max();

  std::array<std::int64_t, 3> above{kLowest, kLowest, kLowest};
  std::array<std::int64_t, 3> below{kHighest, kHighest, kHighest};
  bool is_all = true;  ///< the root's, which has all cells

  bool holds(const Cell& cell) const {
    if (is_all) return true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (cell[axis] <= above[axis] || cell[axis] >= below[axis]) return false;
    return true;
  }
};

class NodeBoxes {
 public:
  /// `leaves` are the tight boxes of the tree's leaves, in order.
  NodeBoxes(const formats::Tree& tree, const std::vector<formats::GridBox>& leaves);

  const formats::Tree& tree() const { return tree_; }

  /// The cells that no point outside of child `child` (0 ... N - 1) of a node falls into, where `region` are those of
  /// the node.
  CellRegion child_region(formats::Level level, std::uint64_t index, std::uint32_t child,
                          const CellRegion& region, const CellOf& cell_of) const;

 private:
  std::size_t split_axis(formats::Level level, std::uint64_t index) const;

  formats::Tree tree_;
  std::vector<std::vector<formats::GridBox>> levels_;
};

}  // namespace cairn::stages
