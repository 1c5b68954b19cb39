// The distinct positions of some records. Neighbourhoods are of positions, not of records: however many
// records share a position, they tell its surroundings once, and a million identical points are one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/dataset/grid.h"

namespace cairn::stages {

struct DistinctPositions {
  /// Of records of `stride` bytes that begin with a grid position.
  DistinctPositions(std::span<const std::byte> records, std::size_t stride,
                    const formats::GridBox& box);

  std::vector<formats::GridPoint>
      positions;                         ///< along a curve: neighbours are searched for in turn
  std::vector<std::uint32_t> of_record;  ///< index into `positions`, for each record
};

/// The distinct positions of the records that lie in `region`, along a curve.
std::vector<formats::GridPoint> distinct_within(std::span<const std::byte> records,
                                                std::size_t stride, const formats::GridBox& region);

}  // namespace cairn::stages
