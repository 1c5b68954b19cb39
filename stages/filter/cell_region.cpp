#include "stages/filter/cell_region.h"

#include <algorithm>

#include "formats/error.h"

namespace cairn::stages {

using formats::GridBox;
using formats::Level;

NodeBoxes::NodeBoxes(const formats::Tree& tree, const std::vector<GridBox>& leaves)
    : tree_(tree), levels_(tree.leaf_level() + 1) {
  CAIRN_CHECK(leaves.size() == tree.nodes_on(tree.leaf_level()));
  levels_.back() = leaves;
  for (Level level = tree.leaf_level(); level-- > 0;) {
    levels_[level].resize(tree.nodes_on(level));
    for (std::size_t child = 0; child < levels_[level + 1].size(); ++child)
      levels_[level][child / tree.fanout()].add(levels_[level + 1][child]);
  }
}

/// An axis on which the children of a node follow each other: that of the split, or another that serves as well.
std::size_t NodeBoxes::split_axis(Level level, std::uint64_t index) const {
  const GridBox* child = &levels_[level + 1][index * tree_.fanout()];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bool follow = true;
    for (std::uint32_t i = 1; i < tree_.fanout(); ++i)
      follow = follow && child[i - 1].max[axis] <= child[i].min[axis];
    if (follow) return axis;
  }
  CAIRN_CHECK(false);
  return 0;
}

CellRegion NodeBoxes::child_region(Level level, std::uint64_t index, std::uint32_t child,
                                   const CellRegion& region, const CellOf& cell_of) const {
  const std::size_t axis = split_axis(level, index);
  const GridBox* box = &levels_[level + 1][index * tree_.fanout() + child];
  CellRegion own = region;
  own.is_all = false;
  if (child > 0) own.above[axis] = std::max(own.above[axis], cell_of(axis, box[-1].max[axis]));
  if (child + 1 < tree_.fanout())
    own.below[axis] = std::min(own.below[axis], cell_of(axis, box[1].min[axis]));
  return own;
}

}  // namespace cairn::stages
