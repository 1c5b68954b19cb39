// The checks of one decoded node, alone and against its decoded parent.
#pragma once

#include "formats/dataset/node_data.h"
#include "stages/verify/findings.h"

namespace cairn::stages {

/// Weights, box, normal cone; and the digest of a leaf whose points are stored without loss. Returns
/// whether the digest was computed.
bool check_node(const formats::DatasetReader& dataset, formats::NodeId id,
                const formats::NodeData& points, Findings& findings);

/// The points of a node against the representatives in its parent: each stands for something, weights
/// add up, spheres are covered.
void check_against_parent(const formats::DatasetReader& dataset, formats::NodeId id,
                          const formats::NodeData& points, const formats::NodeData& parent,
                          Findings& findings);

}  // namespace cairn::stages
