// From an assignment of points to representatives to the representatives themselves: positions and
// attributes as means over input points, errors from exact sums.
#pragma once

#include <span>

#include "formats/dataset/node_record.h"
#include "stages/cluster/reducer.h"
#include "stages/cluster/working_node.h"

namespace cairn::stages {

struct AggregateInput {
  const WorkingNode& node;
  const Reduction& reduction;
  std::uint64_t quota;
  const formats::Grid& grid;
  const formats::Schema& schema;
  /// Of the node's points after quantisation: radii, and by how much a position may have moved (world units).
  std::span<const float> decoded_radius;
  double displacement;
};

/// The node's share of its parent: `quota` representatives in the order of their numbers. Sets all of
/// WorkingNode except digest, weight and box, which are the node's own.
WorkingNode aggregate(const AggregateInput& input);

}  // namespace cairn::stages
