#include "viewer/node_cache.h"

#include <utility>

#include "formats/error.h"

namespace cairn::viewer {

NodeCache::NodeCache(std::size_t nodes) : nodes_(nodes) { CAIRN_CHECK(nodes >= 1); }

const NodePoints* NodeCache::find(NodeIndex node) {
  const auto found = where_.find(node);
  if (found == where_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return &found->second->points;
}

std::optional<NodePoints> NodeCache::put(NodeIndex node, NodePoints points) {
  CAIRN_CHECK(!contains(node));
  std::optional<NodePoints> gone;
  if (entries_.size() == nodes_) {
    gone = std::move(entries_.back().points);
    where_.erase(entries_.back().node);
    entries_.pop_back();
  }
  entries_.push_front({node, std::move(points)});
  where_.emplace(node, entries_.begin());
  return gone;
}

}  // namespace cairn::viewer
