// The arithmetic of the balanced multi-way kd-tree: which nodes there are and how many points each
// holds follows from n, N and s alone.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point
// Models Using Multi-way kd-Trees", 2010, section III.A. Where it departs: the depth is the integer
// nearest to log_N(n/s) instead of the next larger one, as in the paper's own Table II; and it is one
// less where leaves would hold fewer points than a node has children.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn::formats {

/// Number of a node: level by level from the root (0), inside a level in kd-order, so that the
/// children of a node are neighbours.
enum class NodeId : std::uint64_t {};
constexpr std::uint64_t value_of(NodeId id) { return static_cast<std::uint64_t>(id); }

/// Level of a node: 0 is the root, the leaves are on Tree::leaf_level().
using Level = std::uint32_t;

inline constexpr std::uint32_t kMinFanout = 2;
inline constexpr std::uint32_t kMaxFanout = 64;

/// A range of points in kd-order, or of other numbered things.
struct IndexRange {
  std::uint64_t first = 0;
  std::uint64_t count = 0;
  std::uint64_t end() const { return first + count; }
  friend bool operator==(const IndexRange&, const IndexRange&) = default;
};

class Tree {
 public:
  /// The tree of `points` points with fan-out `fanout` and target node size `target_points`.
  /// Requires points >= 1, fanout in 2..64, target_points >= fanout; throws Error (kUsage) otherwise.
  Tree(std::uint64_t points, std::uint32_t fanout, std::uint64_t target_points);

  /// The fan-out of 2..8 whose node size comes closest to `target_points`; on a tie 4, or else the smaller one.
  static std::uint32_t best_fanout(std::uint64_t points, std::uint64_t target_points);

  std::uint64_t points() const { return points_; }
  std::uint32_t fanout() const { return fanout_; }
  std::uint64_t target_points() const { return target_points_; }
  Level leaf_level() const { return leaf_level_; }
  /// s' = ceil(n / N^l): the size of the largest leaf and of every inner node.
  std::uint64_t node_points() const { return node_points_; }

  std::uint64_t nodes_on(Level level) const;
  std::uint64_t node_count() const;
  NodeId id(Level level, std::uint64_t index) const;
  Level level_of(NodeId id) const;
  std::uint64_t index_on_level(NodeId id) const;

  bool is_leaf(NodeId id) const { return level_of(id) == leaf_level_; }
  /// Requires id != root.
  NodeId parent(NodeId id) const;
  /// Requires an inner node; the other children follow it.
  NodeId first_child(NodeId id) const;

  /// A node and all below it, level by level.
  std::vector<NodeId> subtree(NodeId id) const;

  /// The input points below a node, as a range of the kd-order.
  IndexRange input_range(Level level, std::uint64_t index) const;
  /// Points stored in a node: its input points for a leaf, s' for an inner node.
  std::uint64_t stored_points(NodeId id) const;
  /// Representatives that a node hands to its parent: shares of s' that differ by at most one.
  /// Requires id != root.
  std::uint64_t quota(NodeId id) const;
  /// Where the node's representatives begin in its parent: the quotas of its elder siblings together.
  std::uint64_t quota_start(NodeId id) const;

 private:
  std::uint64_t first_id_on(Level level) const;

  std::uint64_t points_;
  std::uint32_t fanout_;
  std::uint64_t target_points_;
  Level leaf_level_;
  std::uint64_t node_points_;
};

}  // namespace cairn::formats
