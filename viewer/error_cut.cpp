#include "viewer/error_cut.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "formats/error.h"
#include "viewer/cut_refinement.h"

namespace cairn::viewer {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double distance_between(const glm::dvec3& point, const Box& box) {
  return glm::length(glm::max(glm::abs(point - box.center) - box.half, 0.0));
}

/// Whether a box comes within `reach` of another, on every axis.
bool touch(const Box& a, const Box& b, double reach) {
  const glm::dvec3 gap = glm::abs(a.center - b.center) - a.half - b.half;
  return std::max({gap.x, gap.y, gap.z}) <= reach;
}

class ErrorGuide {
 public:
  ErrorGuide(const LodTree& tree, const ErrorCutLimits& limits, bool focus_alone)
      : tree_(tree), limits_(limits), focus_alone_(focus_alone) {}

  /// A block's points are at most the bound of its node away from points of the region.
  Sight sight_of(NodeIndex node, NodeIndex region) const {
    if (!limits_.within) return Sight::kSeen;
    const LodNode& below = tree_.node(region);
    return touch(below.box, *limits_.within, region == 0 ? 0 : tree_.node(node).bound)
               ? Sight::kSeen
               : Sight::kOutside;
  }
  void count(Sight) {}
  bool may_use(NodeIndex) const { return true; }

  std::optional<double> priority(NodeIndex node, formats::Level, NodeIndex child) const {
    const double bound = tree_.node(node).bound;
    if (!limits_.focus) return bound;
    const double distance = distance_between(limits_.focus->point, tree_.node(child).box);
    if (distance <= limits_.focus->radius) return kInfinity;
    if (focus_alone_) return std::nullopt;
    return bound / distance;
  }

 private:
  const LodTree& tree_;
  const ErrorCutLimits& limits_;
  bool focus_alone_;  ///< refine nothing beyond its radius
};

/// The points of the least cut that the limits allow, whatever their budget: with all that lies within the radius.
std::uint64_t least_points(const LodTree& tree, const ErrorCutLimits& limits, bool within_radius) {
  ErrorCutLimits without = limits;
  if (!within_radius) without.focus = Focus{.point = {kInfinity, 0, 0}, .radius = 0};
  ErrorGuide guide(tree, without, /*focus_alone=*/true);
  CutRefinement refinement(tree, SelectionLimits::kUnlimited, SelectionLimits::kUnlimited, guide);
  refinement.run();
  return refinement.points();
}

void require_budget(const LodTree& tree, const ErrorCutLimits& limits) {
  if (const std::uint64_t coarsest = least_points(tree, limits, /*within_radius=*/false);
      limits.points < coarsest)
    formats::throw_usage(
        fmt::format("a budget of {} points is below the {} points of this dataset's coarsest node",
                    limits.points, coarsest));
  if (!limits.focus || limits.focus->radius == 0) return;
  if (const std::uint64_t needed = least_points(tree, limits, /*within_radius=*/true);
      limits.points < needed)
    formats::throw_usage(
        fmt::format("a budget of {} points does not hold all that lies within the radius of {:g}, "
                    "with what stands for the rest: that takes {}",
                    limits.points, limits.focus->radius, needed));
}

}  // namespace

ErrorCut select_by_error(const LodTree& tree, const ErrorCutLimits& limits) {
  require_budget(tree, limits);
  ErrorGuide guide(tree, limits, /*focus_alone=*/false);
  CutRefinement refinement(tree, limits.points, SelectionLimits::kUnlimited, guide);
  ErrorCut cut;
  for (const UsedNode& used : refinement.run())
    for (std::uint32_t block = 0; block < tree.blocks(used.node); ++block) {
      if ((used.front >> block & 1) == 0) continue;
      cut.front.push_back({used.node, block});
      cut.bound = std::max(cut.bound, tree.node(used.node).bound);
      cut.finest = cut.finest && tree.is_leaf(used.node);
    }
  cut.points = refinement.points();
  return cut;
}

}  // namespace cairn::viewer
