// Where the points of nodes come from.
#pragma once

#include "viewer/lod_tree.h"
#include "viewer/point_columns.h"

namespace cairn::viewer {

class NodeSource {
 public:
  virtual ~NodeSource() = default;
  /// Fills `points` with a node's columns, in the order of its blocks; what they held before is room to write into. Any
  /// number of threads at a time. Throws formats::Error: kInput for a node that is damaged.
  virtual void load(NodeIndex node, NodePoints& points) const = 0;
};

}  // namespace cairn::viewer
