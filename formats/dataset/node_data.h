// The points of one node in memory, as columns in storage order: what the pack stage encodes and what
// the dataset reader gives back.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/dataset/grid.h"

namespace cairn::formats {

struct NodeData {
  std::vector<GridPoint> position;
  /// For each point the index, in the parent's point order, of the representative that stands for it.
  /// It lies in the parent's block for this child. Empty for the root.
  std::vector<std::uint32_t> representative;
  std::vector<std::uint64_t> weight;  ///< input points a point stands for; empty in leaves (all 1)
  std::vector<float> radius;          ///< world units
  /// One column an attribute of the schema, count * Attribute::size_bytes() bytes; empty where the
  /// node does not carry the attribute (inner nodes, rule kNone).
  std::vector<std::vector<std::byte>> attributes;

  std::size_t count() const { return position.size(); }
};

}  // namespace cairn::formats
