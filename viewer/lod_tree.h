// What of a dataset's index level-of-detail selection works on, in world units and laid out for it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/dataset/node_record.h"
#include "formats/dataset/tree.h"
#include "viewer/camera.h"

namespace cairn::viewer {

/// The number of a node, formats::NodeId as 32 bits.
using NodeIndex = std::uint32_t;

struct LodNode {
  Box box;    ///< of the node's points and of all below it
  Cone cone;  ///< of the node's own normals
  double bound =
      0;  ///< world units: no input point is farther from the point that stands for it here
  float radius_max = 0;  ///< world units: the largest splat radius
  /// World units: the largest splat radius of all that may be drawn for the region, which so reaches out of the box.
  float reach = 0;
  std::uint32_t points = 0;
};

/// A region is what lies below one node; a node that has children holds a block of points for each child's region.
class LodTree {
 public:
  /// Requires the records that a checked index has, in id order. Throws Error (kInput) for a tree of 2^32 nodes or more.
  LodTree(const formats::Tree& tree, const formats::Grid& grid,
          const std::vector<formats::NodeRecord>& records);

  const formats::Tree& shape() const { return shape_; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(nodes_.size()); }
  const LodNode& node(NodeIndex node) const { return nodes_[node]; }
  bool is_leaf(NodeIndex node) const { return node >= first_leaf_; }
  formats::Level level_of(NodeIndex node) const { return shape_.level_of(formats::NodeId{node}); }
  /// Requires node > 0.
  NodeIndex parent(NodeIndex node) const { return (node - 1) / fanout_; }
  /// Requires an inner node and block < fanout.
  NodeIndex child(NodeIndex node, std::uint32_t block) const { return node * fanout_ + 1 + block; }
  std::uint32_t fanout() const { return fanout_; }
  /// Blocks that are drawn one by one: the fan-out, or 1 of a leaf.
  std::uint32_t blocks(NodeIndex node) const { return is_leaf(node) ? 1 : fanout_; }
  /// Points of a block within the node's.
  formats::IndexRange block(NodeIndex node, std::uint32_t block) const {
    const std::uint32_t* start = &block_start_[std::size_t{node} * (fanout_ + 1) + block];
    return {start[0], start[1] - start[0]};
  }
  /// The node whose region a block stands for: the child, or a leaf itself.
  NodeIndex region_of(NodeIndex node, std::uint32_t block) const {
    return is_leaf(node) ? node : child(node, block);
  }
  /// The largest number of points of a node.
  std::uint32_t node_points() const { return node_points_; }

 private:
  formats::Tree shape_;
  std::uint32_t fanout_;
  std::uint32_t first_leaf_;
  std::uint32_t node_points_ = 0;
  std::vector<LodNode> nodes_;
  std::vector<std::uint32_t> block_start_;  ///< fan-out + 1 a node
};

}  // namespace cairn::viewer
