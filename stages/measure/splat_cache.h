// Nodes' splats as far as memory has room for them, shared by all workers.
#pragma once

#include <cstdint>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "stages/measure/splat_node.h"

namespace cairn::stages {

class SplatCache {
 public:
  /// `dataset` must outlive it. What was not used for longest is forgotten where more than `limit_bytes` are held; what
  /// a worker holds stays with it.
  SplatCache(const formats::DatasetReader& dataset, std::uint64_t limit_bytes)
      : dataset_(dataset), limit_bytes_(limit_bytes) {}

  /// The node's splats, made by the first that asks for them, for which others wait. Any thread. Throws as SplatNode.
  std::shared_ptr<const SplatNode> get(formats::NodeId id);

 private:
  using Made = std::shared_future<std::shared_ptr<const SplatNode>>;
  struct Entry {
    formats::NodeId id{};
    std::uint64_t size_bytes = 0;
    Made made;
  };
  void forget_beyond_limit();

  const formats::DatasetReader& dataset_;
  std::uint64_t limit_bytes_;
  std::mutex mutex_;
  std::list<Entry> entries_;  ///< the last used first
  std::unordered_map<std::uint64_t, std::list<Entry>::iterator> by_id_;
  std::uint64_t held_bytes_ = 0;
};

}  // namespace cairn::stages
