#include "stages/neighbors/leaf_boxes.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "formats/error.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;
using formats::Level;

LeafBoxes::LeafBoxes(const formats::Tree& tree, const std::array<double, 3>& step,
                     std::vector<GridBox> leaves)
    : tree_(tree), step_(step), levels_(tree.leaf_level() + 1) {
  CAIRN_CHECK(leaves.size() == tree.nodes_on(tree.leaf_level()));
  std::set<GridPoint> single_positions;
  for (const GridBox& leaf : leaves)
    repeats_.push_back(leaf.min == leaf.max && !single_positions.insert(leaf.min).second);
  levels_.back() = std::move(leaves);
  for (Level level = tree.leaf_level(); level-- > 0;) {
    levels_[level].resize(tree.nodes_on(level));
    for (std::size_t child = 0; child < levels_[level + 1].size(); ++child)
      if (level + 1 < tree.leaf_level() || !repeats(child))
        levels_[level][child / tree.fanout()].add(levels_[level + 1][child]);
  }
}

bool NearLeaves::Waiting::operator>(const Waiting& other) const {
  return std::tie(squared_distance, level, index) >
         std::tie(other.squared_distance, other.level, other.index);
}

NearLeaves::NearLeaves(const LeafBoxes& boxes, std::uint64_t leaf) : boxes_(boxes), leaf_(leaf) {
  push(0, 0);
}

void NearLeaves::push(Level level, std::uint64_t index) {
  const bool leaf = level == boxes_.tree().leaf_level();
  if (leaf ? boxes_.repeats(index) : boxes_.node(level, index).empty()) return;
  waiting_.push({squared_distance(boxes_.step(), boxes_.node(level, index), boxes_.leaf(leaf_)),
                 level, index});
}

const NearLeaves::Near* NearLeaves::at(std::size_t i) {
  const formats::Tree& tree = boxes_.tree();
  while (found_.size() <= i && !waiting_.empty()) {
    const Waiting next = waiting_.top();
    waiting_.pop();
    if (next.level < tree.leaf_level()) {
      for (std::uint32_t child = 0; child < tree.fanout(); ++child)
        push(next.level + 1, next.index * tree.fanout() + child);
    } else if (next.index != leaf_) {
      found_.push_back({next.squared_distance, next.index});
    }
  }
  return i < found_.size() ? &found_[i] : nullptr;
}

}  // namespace cairn::stages
