// The loop that all selections share: a cut through the tree, refined from the root on, the block of greatest priority
// first, until the budget has no room for the next. What is seen and what comes first is for a guide to say.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point Models Using
// Multi-way kd-Trees", 2010, section IV, figure 5; see lod_selection.h for where it departs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <queue>
#include <tuple>
#include <vector>

#include "viewer/lod_tree.h"

namespace cairn::viewer {

/// What a guide says of a region; only what is seen or hidden is on the front, and only what is seen is refined.
enum class Sight : std::uint8_t { kSeen, kHidden, kOutside, kFacingAway };

/// A node in use and, as bits, its blocks that are on the front.
struct UsedNode {
  NodeIndex node = 0;
  formats::Level level = 0;
  std::uint64_t front = 0;
  std::uint64_t hidden =
      0;  ///< those of the front that are not refined because their regions are hidden
};
static_assert(formats::kMaxFanout <= 64);

/// A guide has
///   Sight sight_of(NodeIndex node, NodeIndex region): of a region as a block of `node` (of the root: its own) draws it;
///   void count(Sight): told of all that is looked into for the cut;
///   bool may_use(NodeIndex): whether a node may take the place of its parent's block;
///   std::optional<double> priority(NodeIndex node, Level level, NodeIndex child): of refining the block of `node`, which
///     is on `level`, for `child`; nothing: it is good enough. No NaN.
template <typename Guide>
class CutRefinement {
 public:
  CutRefinement(const LodTree& tree, std::uint64_t budget, std::uint64_t most_nodes, Guide& guide)
      : tree_(tree), budget_(budget), most_nodes_(most_nodes), guide_(guide) {}

  /// The nodes in use, in ascending order; none if the root is not seen. Once.
  std::vector<UsedNode> run() {
    const Sight root = guide_.sight_of(0, 0);
    guide_.count(root);
    if (root != Sight::kSeen && root != Sight::kHidden) return {};
    use(look_into(0, 0));
    while (!queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      if (used_.size() >= most_nodes_ || !refine(next)) break;
    }
    std::ranges::sort(used_, {}, &UsedNode::node);
    return std::move(used_);
  }

  std::uint64_t points() const { return points_; }  ///< of the front

 private:
  struct Candidate {
    double priority = 0;
    std::size_t used = 0;  ///< index of the node
    NodeIndex child = 0;
    std::uint32_t block = 0;
  };

  /// The greatest priority first, the node that comes first on a tie: a total order.
  struct Later {
    bool operator()(const Candidate& a, const Candidate& b) const {
      return std::tie(a.priority, b.child) < std::tie(b.priority, a.child);
    }
  };

  /// What a node would draw if it were in use.
  struct Look {
    UsedNode used;
    std::uint64_t points = 0;
    std::uint64_t outside = 0;
    std::uint64_t facing_away = 0;
  };

  Look look_into(NodeIndex node, formats::Level level) {
    Look look{.used = {.node = node, .level = level}};
    for (std::uint32_t block = 0; block < tree_.blocks(node); ++block) {
      // A leaf is one region, which was seen as its parent's block.
      const Sight sight =
          tree_.is_leaf(node) ? Sight::kSeen : guide_.sight_of(node, tree_.child(node, block));
      if (sight == Sight::kOutside) ++look.outside;
      if (sight == Sight::kFacingAway) ++look.facing_away;
      if (sight == Sight::kOutside || sight == Sight::kFacingAway) continue;
      const std::uint64_t bit = std::uint64_t{1} << block;
      look.used.front |= bit;
      if (sight == Sight::kHidden) look.used.hidden |= bit;
      look.points += tree_.block(node, block).count;
    }
    return look;
  }

  /// Puts the candidate's child in the place of its block. Returns false if the budget has no room.
  bool refine(const Candidate& candidate) {
    UsedNode& parent = used_[candidate.used];
    const Look look = look_into(candidate.child, parent.level + 1);
    const std::uint64_t points =
        points_ - tree_.block(parent.node, candidate.block).count + look.points;
    if (points > budget_) return false;
    if (!guide_.may_use(candidate.child)) return true;
    parent.front &= ~(std::uint64_t{1} << candidate.block);
    points_ -= tree_.block(parent.node, candidate.block).count;
    use(look);
    return true;
  }

  void use(const Look& look) {
    const std::size_t index = used_.size();
    used_.push_back(look.used);
    points_ += look.points;
    for (std::uint64_t i = 0; i < look.outside; ++i) guide_.count(Sight::kOutside);
    for (std::uint64_t i = 0; i < look.facing_away; ++i) guide_.count(Sight::kFacingAway);
    const NodeIndex node = look.used.node;
    if (tree_.is_leaf(node)) return;
    for (std::uint32_t block = 0; block < tree_.fanout(); ++block) {
      const std::uint64_t bit = std::uint64_t{1} << block;
      if ((look.used.front & ~look.used.hidden & bit) == 0) continue;
      const NodeIndex child = tree_.child(node, block);
      if (const std::optional<double> priority = guide_.priority(node, look.used.level, child))
        queue_.push({*priority, index, child, block});
    }
  }

  const LodTree& tree_;
  std::uint64_t budget_;
  std::uint64_t most_nodes_;
  Guide& guide_;
  std::vector<UsedNode> used_;
  std::priority_queue<Candidate, std::vector<Candidate>, Later> queue_;
  std::uint64_t points_ = 0;
};

}  // namespace cairn::viewer
