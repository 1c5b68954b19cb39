// A cut for other purposes than a picture: what stands for a dataset on a budget, wherever it may be looked at from, or
// finest around a point of interest. The loop is that of lod_selection; what comes first is told by the recorded error.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "viewer/lod_selection.h"
#include "viewer/lod_tree.h"

namespace cairn::viewer {

/// A point of interest, and how far around it nothing may be left out.
struct Focus {
  glm::dvec3 point{0, 0, 0};
  double radius = 0;  ///< world units, not negative
};

struct ErrorCutLimits {
  std::uint64_t points = SelectionLimits::kUnlimited;  ///< never more points
  std::optional<Focus> focus;
  /// Only what touches this box counts and is on the front; nothing: all.
  std::optional<Box> within;
};

struct ErrorCut {
  std::vector<FrontBlock>
      front;  ///< in the order of nodes; each region that counts lies below exactly one
  std::uint64_t points = 0;  ///< of the front
  double bound = 0;    ///< world units: no point of a region is farther from what stands for it
  bool finest = true;  ///< all blocks are leaves
};

/// Refines the block with the greatest error first: the recorded bound of its node, with a focus divided by the
/// distance from the point to the block's region, so that what is left is about as large an angle from there
/// everywhere. Regions within the radius come before all others, coarse before fine; at radius 0 those are the ones
/// whose box holds the point. Ensures points <= limits.points, and points > limits.points - node_points() unless all
/// blocks are leaves. Requires limits.points >= the root's points, or within a box what of these touches it; throws
/// Error (kUsage) otherwise, and where a radius above 0 is given and what lies within it does not fit the budget, telling
/// the least that does.
ErrorCut select_by_error(const LodTree& tree, const ErrorCutLimits& limits);

}  // namespace cairn::viewer
