#include "viewer/lod_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "formats/error.h"
#include "viewer/cut_refinement.h"

namespace cairn::viewer {
namespace {

/// Guides a refinement by what a view shows, and makes the selection of it.
class Selector {
 public:
  Selector(const LodTree& tree, const View& view, const SelectionLimits& limits,
           const NodeTest& usable, const NodeTest& hidden)
      : tree_(tree), view_(view), limits_(limits), usable_(usable), hidden_(hidden) {}

  Selection run() {
    CutRefinement refinement(tree_, limits_.points, limits_.nodes, *this);
    used_ = refinement.run();
    result_.points = refinement.points();
    finish();
    return std::move(result_);
  }

  // What CutRefinement asks.

  Sight sight_of(NodeIndex /*node*/, NodeIndex region) const {
    const LodNode& node = tree_.node(region);
    if (!view_.may_see(node.box, node.reach)) return Sight::kOutside;
    if (limits_.cull_back_faces && view_.faces_away(node.box, node.cone)) return Sight::kFacingAway;
    return hidden_ && hidden_(region) ? Sight::kHidden : Sight::kSeen;
  }

  void count(Sight sight) {
    if (sight == Sight::kOutside) ++result_.outside;
    if (sight == Sight::kFacingAway) ++result_.facing_away;
  }

  bool may_use(NodeIndex node) const { return !usable_ || usable_(node); }

  std::optional<double> priority(NodeIndex node, formats::Level level, NodeIndex child) const {
    const Box& box = tree_.node(child).box;
    if (limits_.pixel_error > 0 &&
        view_.pixel_bound(box, tree_.node(node).bound) <= limits_.pixel_error)
      return std::nullopt;
    const PriorityConstants& c = limits_.priority;
    const double distance = std::max(view_.distance(box), view_.near());
    const double levels_left = tree_.shape().leaf_level() - level + 1.0;
    return c.c0 * levels_left / (c.c1 * distance + c.c2 * distance * distance);
  }

 private:
  void finish() {
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
