// Which nodes a frame is drawn with: a cut through the tree, refined from the root as far as the limits allow.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point Models Using
// Multi-way kd-Trees", 2010, section IV, figure 5. Where it departs: refinement is by child, so that a node's block for
// one child gives way to that child while its other blocks stay drawn; a count is of the points that are really drawn,
// culled blocks left out; and blocks whose recorded error is small enough on the screen are not refined.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "viewer/lod_tree.h"

namespace cairn::viewer {

/// Constants of the priority e = c0 (l_max - l + 1) / (c1 d + c2 d^2), d in world units.
struct PriorityConstants {
  double c0 = 1;
  double c1 = 1;
  double c2 = 0;
};

struct SelectionLimits {
  static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

  std::uint64_t points = kUnlimited;  ///< the budget B: never more points are drawn
  double pixel_error =
      0;  ///< no block is refined whose projected bound is not above this many pixels
  std::uint64_t nodes = kUnlimited;  ///< nodes that are held at a time, at least 1
  bool cull_back_faces = false;      ///< by normal cones
  PriorityConstants priority;
};

/// One block on the front.
struct FrontBlock {
  NodeIndex node = 0;
  std::uint32_t block = 0;
  bool hidden = false;  ///< its region is in the picture, but was hidden by others a frame ago
};

/// A cut: the nodes that are in use form a tree with the root on top, and a block is on the front where its child is not
/// in use (or its node is a leaf). Each visible region lies below exactly one block of the front.
struct Selection {
  std::vector<NodeIndex> nodes;   ///< in use, in ascending order; empty if nothing is visible
  std::vector<FrontBlock> front;  ///< blocks to draw, in the order of nodes
  std::uint64_t points = 0;       ///< of the front
  double pixel_bound = 0;         ///< the largest projected bound on the front
  double inner_bound = 0;     ///< of blocks that are not leaves: those that a budget could refine
  double splat_pixels = 0;    ///< the largest splat radius on the front, pixels
  std::uint64_t outside = 0;  ///< regions met that are outside of the picture,
  std::uint64_t facing_away = 0;  ///< that turn their backs to the eye,
  std::uint64_t hidden = 0;       ///< and that were hidden a frame ago
  bool finest = true;             ///< all blocks on the front are leaves: no budget would draw more
};

/// Tells something of a node; empty stands for `no` or for `all`, as told where it is used.
using NodeTest = std::function<bool(NodeIndex)>;

/// Refines from the root on, the block of greatest priority first, until the budget has no room for the next.
/// `usable`: nodes that may be drawn or refined to; empty: all. The root must be. `hidden`: regions that are not
/// refined because others hide them; empty: none. Ensures points <= limits.points, and points > limits.points -
/// node_points() unless nothing is left to refine: all blocks are leaves, hidden, not usable, exact enough, or limits.nodes
/// are in use. Requires limits.points >= the root's points (kUsage otherwise).
Selection select(const LodTree& tree, const View& view, const SelectionLimits& limits,
                 const NodeTest& usable = {}, const NodeTest& hidden = {});

}  // namespace cairn::viewer
