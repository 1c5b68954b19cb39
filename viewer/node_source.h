// Where the points of nodes come from.
#pragma once

#include <functional>
#include <span>
#include <stop_token>

#include "viewer/lod_tree.h"
#include "viewer/point_columns.h"

namespace cairn::viewer {

class NodeSource {
 public:
  virtual ~NodeSource() = default;
  /// Fills `points` with a node's columns, in the order of its blocks; what they held before is room to write into. Any
  /// number of threads at a time. Throws formats::Error: kInput for a node that is damaged.
  /// Throws Stopped: a network was waited for when `stop` was requested.
  virtual void load(NodeIndex node, NodePoints& points, const std::stop_token& stop) const = 0;

  // For sources behind a network; on a disk these do nothing.

  /// What will be loaded, the most urgent first, in the place of what was told before.
  virtual void expect(std::span<const NodeIndex> /*nodes*/) const {}
  /// Whether loading would not wait; it may fail, though. Any number of threads at a time.
  virtual bool ready(NodeIndex /*node*/) const { return true; }
  /// `arrived` is called by another thread when a node has become ready; an empty one ends that, and is not called any more
  /// once this returns.
  virtual void listen(const std::function<void()>& /*arrived*/) const {}
  virtual bool is_remote() const { return false; }
};

}  // namespace cairn::viewer
