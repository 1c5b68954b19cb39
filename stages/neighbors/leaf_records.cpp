#include "stages/neighbors/leaf_records.h"

#include <cstring>

#include "stages/parallel.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;

std::vector<GridBox> LeafRecords::boxes(const Context& context) const {
  std::vector<GridBox> boxes(leaves());
  for_each_piece(leaves(), [&](std::uint64_t leaf) {
    throw_if_stopped(context);
    const auto records = of(leaf);
    for (std::size_t at = 0; at < records.size(); at += stride_)
      boxes[leaf].add(position_of(records.data() + at));
    release(leaf);
  });
  return boxes;
}

GridPoint position_of(const std::byte* record) {
  GridPoint position;
  std::memcpy(position.data(), record, sizeof position);
  return position;
}

}  // namespace cairn::stages
