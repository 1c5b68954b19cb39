// How a finished node travels from the cluster stage to the pack stage, which know nothing of each
// other: the one calls a NodeSink for each node, the other is one.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/dataset/node_data.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/numerics.h"
#include "stages/unit_state.h"

namespace cairn::stages {

/// A node whose points stand in storage order, before quantisation, with all that its record tells of
/// it and that its points alone do not.
struct ClusteredNode {
  formats::NodeId id{};
  formats::NodeData points;
  std::vector<std::uint32_t> block_start;  ///< N + 1 entries as in NodeRecord
  formats::GridBox subtree_box;            ///< tight box of all input points below this node
  std::uint64_t weight = 0;
  double squared_error =
      0;  ///< sum over input points of the squared world distance to their representative here
  double bound = 0;  ///< largest such distance, before this node's own quantisation; rounded up
  /// For each point how far the spheres that it stands for reach from it (world units, before this
  /// node's own quantisation); empty in leaves.
  std::vector<double> reach;
  float theta = 0;         ///< degrees, as in NodeRecord
  std::uint32_t grid = 0;  ///< as in NodeRecord
  formats::Digest digest;
  formats::Numerics numerics;  ///< nothing of quantisation yet
};

/// Takes finished nodes, from several threads, in any order.
class NodeSink {
 public:
  virtual ~NodeSink() = default;
  virtual void take(ClusteredNode&& node) = 0;
  /// All that is needed to put the nodes of a subtree, each taken before, back into the sink of a later run.
  virtual void save(formats::NodeId subtree, StateWriter& state) const = 0;
  /// Puts them back, as if they were taken. False if they cannot be: then nothing is.
  virtual bool restore(formats::NodeId subtree, StateReader& state) = 0;
};

}  // namespace cairn::stages
