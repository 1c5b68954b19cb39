// One way for all readers to lay out the block that they fill.
#pragma once

#include <cstddef>

#include "formats/point_block.h"
#include "formats/schema.h"

namespace cairn::formats {

/// Readers keep blocks below about this size, so wide records give blocks of fewer points.
inline constexpr std::size_t kMaxBlockBytes = std::size_t{4} << 20;

/// Points that a reader puts into a block whose records have this many bytes; at least 1.
inline std::size_t block_points_for(std::size_t record_bytes) {
  const std::size_t fitting = kMaxBlockBytes / (record_bytes == 0 ? 1 : record_bytes);
  return fitting == 0 ? 1 : (fitting < kBlockPoints ? fitting : kBlockPoints);
}

/// Makes `block` hold `count` points with the attributes of `schema`. Buffers that are large enough
/// are used again; their contents are unspecified, but for points that remain of more.
inline void resize_block(const Schema& schema, PositionEncoding encoding, std::size_t count,
                         PointBlock& block) {
  const bool steps = encoding == PositionEncoding::kSteps;
  block.count = count;
  block.steps.resize(steps ? count : 0);
  block.world.resize(steps ? 0 : count);
  block.columns.resize(schema.size());
  for (std::size_t i = 0; i < schema.size(); ++i)
    block.columns[i].resize(count * schema[i].size_bytes());
}

}  // namespace cairn::formats
