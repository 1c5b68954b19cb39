// From the records of a leaf to its working columns.
#pragma once

#include <span>

#include "formats/dataset/node_record.h"
#include "stages/cluster/working_node.h"

namespace cairn::stages {

/// `records` holds the leaf's points: 12-byte grid position, then the attributes of
/// formats::record_schema. Radii that are negative, infinite or NaN become 0; normals are brought
/// to unit length, or to zero where they have none.
WorkingNode load_leaf(const formats::DatasetHeader& header, std::span<const std::byte> records,
                      std::size_t stride);

/// Puts the points of a leaf into the order `order`: new point i is old point order[i].
void reorder_leaf(WorkingNode& leaf, const formats::Schema& schema,
                  std::span<const std::uint32_t> order);

}  // namespace cairn::stages
