// From the records of a leaf to its working columns: what decides on the order of its points, and then the rest in that
// order.
#pragma once

#include <span>

#include "formats/dataset/node_record.h"
#include "stages/cluster/working_node.h"

namespace cairn::stages {

/// The points of a leaf: 12-byte grid position, then the attributes of formats::record_schema.
struct LeafRecords {
  std::span<const std::byte> bytes;
  std::size_t stride;
};

/// All but the attributes. Radii are as import left them, finite and not negative; normals are brought to unit length, or
/// to zero where they have none.
WorkingNode load_leaf(const formats::DatasetHeader& header, const LeafRecords& records);

/// Puts the points of a leaf into the order `order`: new point i is old point order[i]; and loads their attributes.
void reorder_leaf(WorkingNode& leaf, const formats::DatasetHeader& header,
                  const LeafRecords& records, std::span<const std::uint32_t> order);

}  // namespace cairn::stages
