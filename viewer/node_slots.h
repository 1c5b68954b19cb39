// Which nodes lie in which of a fixed number of equal slots: least recently used first out, and never a node without
// its parent. All nodes have one size, so slots are never cut up and memory is taken once.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, 2010, section IV. Where it departs: because a node is held only together
// with its ancestors, every region of the tree always has a nearest ancestor at hand to stand in for what is missing, and
// coarsening (children to ancestor) never waits.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "viewer/lod_tree.h"

namespace cairn::viewer {

class NodeSlots {
 public:
  /// Requires slots >= 1.
  NodeSlots(std::uint32_t slots, std::uint32_t fanout);

  std::uint32_t slots() const { return static_cast<std::uint32_t>(entries_.size()); }
  std::uint32_t held() const { return static_cast<std::uint32_t>(slot_of_.size()); }
  std::optional<std::uint32_t> find(NodeIndex node) const;
  bool holds(NodeIndex node) const { return slot_of_.contains(node); }
  /// Whether `node` may be inserted: it is the root, or its parent is held.
  bool accepts(NodeIndex node) const { return node == 0 || holds((node - 1) / fanout_); }

  /// Begins a frame and marks the nodes in use, those of them that are held: they stay until the next frame. `nodes` are
  /// in ascending order and hold the ancestors of each.
  void begin_frame(std::span<const NodeIndex> nodes);
  /// The slot for a node that is not held, in the place of the node that was used longest ago; nothing if all others are
  /// in use in this frame. Requires accepts(node).
  std::optional<std::uint32_t> insert(NodeIndex node);

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Entry {
    NodeIndex node = 0;
    std::uint64_t used_in = 0;  ///< number of the frame
    std::uint32_t newer = kNone;
    std::uint32_t older = kNone;
  };

  void touch(std::uint32_t slot);
  void touch_with_ancestors(NodeIndex node);
  void unlink(std::uint32_t slot);
  void link_newest(std::uint32_t slot);

  std::uint32_t fanout_;
  std::uint64_t frame_ = 0;
  std::vector<Entry> entries_;
  std::unordered_map<NodeIndex, std::uint32_t> slot_of_;
  std::uint32_t newest_ = kNone;
  std::uint32_t oldest_ = kNone;
};

}  // namespace cairn::viewer
