// Where the leaves lie: tight boxes of all nodes of the tree, and the leaves around one of them in the
// order of their distance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <queue>
#include <vector>

#include "formats/dataset/grid.h"
#include "formats/dataset/tree.h"
#include "stages/box_distance.h"

namespace cairn::stages {

class LeafBoxes {
 public:
  /// `leaves` are the tight boxes of the tree's leaves, in order.
  LeafBoxes(const formats::Tree& tree, const std::array<double, 3>& step,
            std::vector<formats::GridBox> leaves);

  const formats::GridBox& leaf(std::uint64_t index) const { return levels_.back()[index]; }
  /// Of all leaves below that do not repeat another; empty where all do.
  const formats::GridBox& node(formats::Level level, std::uint64_t index) const {
    return levels_[level][index];
  }
  /// Whether all points of the leaf are at one position, and those of an earlier leaf too. Thousands of leaves can
  /// be: they need not all be looked at to find neighbours.
  bool repeats(std::uint64_t leaf) const { return repeats_[leaf]; }
  const formats::Tree& tree() const { return tree_; }
  const std::array<double, 3>& step() const { return step_; }

 private:
  formats::Tree tree_;
  std::array<double, 3> step_;
  std::vector<std::vector<formats::GridBox>> levels_;
  std::vector<bool> repeats_;
};

/// All other leaves but those that repeat another, nearest box first; found as far as they are asked for.
class NearLeaves {
 public:
  struct Near {
    double squared_distance;  ///< between the boxes
    std::uint64_t leaf;
  };

  /// `boxes` must outlive it.
  NearLeaves(const LeafBoxes& boxes, std::uint64_t leaf);

  /// Number `i` of the other leaves; nothing if there are no more than i.
  const Near* at(std::size_t i);

 private:
  struct Waiting {
    double squared_distance;
    formats::Level level;
    std::uint64_t index;
    bool operator>(const Waiting& other) const;
  };
  void push(formats::Level level, std::uint64_t index);

  const LeafBoxes& boxes_;
  std::uint64_t leaf_;
  std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> waiting_;
  std::vector<Near> found_;
};

}  // namespace cairn::stages
