#include "viewer/lod_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <queue>
#include <tuple>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// A node in use and, as bits, its blocks that are on the front.
struct UsedNode {
  NodeIndex node = 0;
  formats::Level level = 0;
  std::uint64_t front = 0;
  std::uint64_t hidden =
      0;  ///< those of the front that are not refined because their regions are hidden
};
static_assert(formats::kMaxFanout <= 64);

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

class Selector {
 public:
  Selector(const LodTree& tree, const View& view, const SelectionLimits& limits,
           const NodeTest& usable, const NodeTest& hidden)
      : tree_(tree), view_(view), limits_(limits), usable_(usable), hidden_(hidden) {}

  Selection run() {
    const Sight root = sight_of(0);
    count(root);
    if (root != Sight::kSeen && root != Sight::kHidden) return std::move(result_);
    use(look_into(0, 0));
    while (!queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      if (used_.size() >= limits_.nodes || !refine(next)) break;
    }
    finish();
    return std::move(result_);
  }

 private:
  enum class Sight { kSeen, kHidden, kOutside, kFacingAway };

  /// What a node would draw if it were in use.
  struct Look {
    UsedNode used;
    std::uint64_t points = 0;
    std::uint64_t outside = 0;
    std::uint64_t facing_away = 0;
  };

  Sight sight_of(NodeIndex region) const {
    const LodNode& node = tree_.node(region);
    if (!view_.may_see(node.box, node.reach)) return Sight::kOutside;
    if (limits_.cull_back_faces && view_.faces_away(node.box, node.cone)) return Sight::kFacingAway;
    return hidden_ && hidden_(region) ? Sight::kHidden : Sight::kSeen;
  }

  void count(Sight sight) {
    if (sight == Sight::kOutside) ++result_.outside;
    if (sight == Sight::kFacingAway) ++result_.facing_away;
  }

  Look look_into(NodeIndex node, formats::Level level) const {
    Look look{.used = {.node = node, .level = level}};
    for (std::uint32_t block = 0; block < tree_.blocks(node); ++block) {
      // A leaf is one region, which was seen as its parent's block.
      const Sight sight = tree_.is_leaf(node) ? Sight::kSeen : sight_of(tree_.child(node, block));
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
        result_.points - tree_.block(parent.node, candidate.block).count + look.points;
    if (points > limits_.points) return false;
    if (usable_ && !usable_(candidate.child)) return true;
    parent.front &= ~(std::uint64_t{1} << candidate.block);
    result_.points -= tree_.block(parent.node, candidate.block).count;
    use(look);
    return true;
  }

  void use(const Look& look) {
    const std::size_t index = used_.size();
    used_.push_back(look.used);
    result_.points += look.points;
    result_.outside += look.outside;
    result_.facing_away += look.facing_away;
    const NodeIndex node = look.used.node;
    if (tree_.is_leaf(node)) return;
    for (std::uint32_t block = 0; block < tree_.fanout(); ++block) {
      const std::uint64_t bit = std::uint64_t{1} << block;
      if ((look.used.front & ~look.used.hidden & bit) == 0) continue;
      const NodeIndex child = tree_.child(node, block);
      const Box& box = tree_.node(child).box;
      if (limits_.pixel_error > 0 &&
          view_.pixel_bound(box, tree_.node(node).bound) <= limits_.pixel_error)
        continue;
      queue_.push({priority(look.used.level, box), index, child, block});
    }
  }

  double priority(formats::Level level, const Box& box) const {
    const PriorityConstants& c = limits_.priority;
    const double distance = std::max(view_.distance(box), view_.near());
    const double levels_left = tree_.shape().leaf_level() - level + 1.0;
    return c.c0 * levels_left / (c.c1 * distance + c.c2 * distance * distance);
  }

  void finish() {
    std::ranges::sort(used_, {}, &UsedNode::node);
    for (const UsedNode& used : used_) {
      result_.nodes.push_back(used.node);
      const LodNode& node = tree_.node(used.node);
      for (std::uint32_t block = 0; block < tree_.blocks(used.node); ++block) {
        const std::uint64_t bit = std::uint64_t{1} << block;
        if ((used.front & bit) == 0) continue;
        const bool hidden = (used.hidden & bit) != 0;
        result_.front.push_back({used.node, block, hidden});
        if (hidden) ++result_.hidden;
        result_.finest = result_.finest && tree_.is_leaf(used.node);
        const Box& box = tree_.node(tree_.region_of(used.node, block)).box;
        const double bound = view_.pixel_bound(box, node.bound);
        result_.pixel_bound = std::max(result_.pixel_bound, bound);
        if (!tree_.is_leaf(used.node)) result_.inner_bound = std::max(result_.inner_bound, bound);
        const double depth = std::max(view_.nearest_depth(box), view_.near());
        result_.splat_pixels =
            std::max(result_.splat_pixels, view_.focal_pixels() * node.radius_max / depth);
      }
    }
  }

  const LodTree& tree_;
  const View& view_;
  const SelectionLimits& limits_;
  const NodeTest& usable_;
  const NodeTest& hidden_;
  std::vector<UsedNode> used_;
  std::priority_queue<Candidate, std::vector<Candidate>, Later> queue_;
  Selection result_;
};

}  // namespace

Selection select(const LodTree& tree, const View& view, const SelectionLimits& limits,
                 const NodeTest& usable, const NodeTest& hidden) {
  if (limits.points < tree.node(0).points)
    formats::throw_usage(
        fmt::format("a budget of {} points is below the {} points of this dataset's coarsest node",
                    limits.points, tree.node(0).points));
  CAIRN_CHECK(limits.nodes >= 1);
  return Selector(tree, view, limits, usable, hidden).run();
}

}  // namespace cairn::viewer
