// Cluster: the levels above the leaves, bottom-up. A node's points are the representatives of its
// children, one block a child; independent subtrees run in parallel, and each node is handed on as soon
// as it is known what stands for its points.
// Based on: Goswami et al. 2010, section III.B, procedure NdTree (Figure 3). Where it departs: a leaf's
// points are stored in the order of their representatives, but an inner node's blocks stay in curve
// order, each point naming its representative; ordering them too would hang every node's order on its
// ancestors', and no node could be written before the root is done.
#pragma once

#include "formats/dataset/node_record.h"
#include "stages/cluster/reducer.h"
#include "stages/clustered_node.h"
#include "stages/context.h"

namespace cairn::stages {

struct ClusterInput {
  /// All records in kd-order: 12-byte grid position, then the attributes of formats::record_schema. May be empty where an
  /// earlier run was done with them.
  formats::ExternalArray& records;
  std::size_t stride;
  const formats::DatasetHeader& header;
  const Reducer& reducer;
  std::optional<std::uint32_t> grid;  ///< K as in ClusterOptions
};

/// Memory that one worker may hold, by measurement rounded up: its node, and the shares that wait on the
/// path to the root. `stride` as in ClusterInput.
std::uint64_t cluster_worker_bytes(const formats::Tree& tree, std::size_t stride);

/// Clusters the whole tree and hands every node to `sink`.
void cluster(const ClusterInput& input, NodeSink& sink, Context& context);

}  // namespace cairn::stages
