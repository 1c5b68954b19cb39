// Decoded nodes in memory, beside what the renderer holds: a number of nodes, those that were used longest ago go first.
#pragma once

#include <cstddef>
#include <list>
#include <optional>
#include <unordered_map>

#include "viewer/lod_tree.h"
#include "viewer/point_columns.h"

namespace cairn::viewer {

class NodeCache {
 public:
  /// Requires nodes >= 1.
  explicit NodeCache(std::size_t nodes);

  std::size_t size() const { return entries_.size(); }
  bool contains(NodeIndex node) const { return where_.contains(node); }
  /// The node's points, which now count as used; null if it is not here. Valid until the next put.
  const NodePoints* find(NodeIndex node);
  /// Adds a node that is not here. Returns the memory of the node that went for it, if one did.
  std::optional<NodePoints> put(NodeIndex node, NodePoints points);

 private:
  struct Entry {
    NodeIndex node;
    NodePoints points;
  };

  std::size_t nodes_;
  std::list<Entry> entries_;  ///< the newest first
  std::unordered_map<NodeIndex, std::list<Entry>::iterator> where_;
};

}  // namespace cairn::viewer
