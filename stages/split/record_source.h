// Where a split pass reads its records from: slabs of the import array, whose positions still need
// mapping to the dataset grid, or slabs of a work array, whose positions are grid steps already.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/scans/position_map.h"
#include "stages/parallel.h"
#include "stages/split/rounding.h"

namespace cairn::stages {

/// Consecutive records of one array, small enough to be one parallel step.
struct Slab {
  formats::ExternalArray* array = nullptr;
  std::uint64_t first_byte = 0;
  std::uint64_t count = 0;
  std::size_t stride = 0;                     ///< bytes of a record
  std::size_t position_bytes = 12;            ///< in front of each record
  const formats::PositionMap* map = nullptr;  ///< none: positions are grid steps
  Rounding* rounding = nullptr;  ///< where it is added up what the map rounds off; none: nothing is

  const std::byte* record(std::uint64_t i) const {
    return array->bytes().data() + first_byte + i * stride;
  }
  void release() const { array->release(first_byte, count * stride); }
};

/// Bytes of records in one step of a parallel pass. A constant: nothing may depend on the number of threads.
inline constexpr std::uint64_t kSlabBytes = std::uint64_t{8} << 20;

inline std::uint64_t slab_records(std::size_t stride) {
  return std::max<std::uint64_t>(1, kSlabBytes / stride);
}

/// How the slabs of a node are walked through.
struct PassMode {
  const Context& context;  ///< asked whether to stop; told of the records that are done
  bool parallel = false;   ///< slabs side by side
  bool release =
      false;  ///< give a slab's pages back as soon as it is done: the node does not fit in memory
};

/// Calls visit(i) for every slab: in order, or side by side. Throws Stopped between slabs.
template <typename Visit>
void for_each_slab(std::span<const Slab> slabs, const PassMode& mode, Visit&& visit) {
  const auto step = [&](std::uint64_t i) {
    throw_if_stopped(mode.context);
    visit(i);
    if (mode.release) slabs[i].release();
  };
  if (mode.parallel) return for_each_piece(slabs.size(), step);
  for (std::uint64_t i = 0; i < slabs.size(); ++i) step(i);
}

/// Some records of a slab, which follow each other, with their grid positions.
struct RecordBlock {
  const std::byte* records;
  std::size_t stride;
  const std::byte* positions;  ///< three int32 each
  std::size_t position_stride;
  std::size_t count;  ///< kMost at most

  static constexpr std::size_t kMost =
      1024;  ///< what is told of each of them stays in the nearest cache

  formats::GridPoint position(std::size_t i) const {
    formats::GridPoint position;
    std::memcpy(position.data(), positions + i * position_stride, sizeof(position));
    return position;
  }
};

/// Calls visit(block) for all records of a slab, in order.
template <typename Visit>
void for_each_block(const Slab& slab, const Visit& visit) {
  std::array<formats::GridPoint, RecordBlock::kMost> mapped;
  for (std::uint64_t first = 0; first < slab.count; first += RecordBlock::kMost) {
    const std::byte* records = slab.record(first);
    const std::size_t count = std::min<std::uint64_t>(RecordBlock::kMost, slab.count - first);
    if (slab.map == nullptr) {
      visit(RecordBlock{records, slab.stride, records, slab.stride, count});
      continue;
    }
    for (std::size_t i = 0; i < count; ++i) mapped[i] = slab.map->map(records + i * slab.stride);
    visit(RecordBlock{records, slab.stride, reinterpret_cast<const std::byte*>(mapped.data()),
                      sizeof(formats::GridPoint), count});
  }
}

/// Coordinates as steps above the smallest of a node.
using BlockKeys = std::array<std::uint32_t, RecordBlock::kMost>;

/// Those of the records of a block on an axis; `low` is the smallest.
inline void load_keys(const RecordBlock& block, std::size_t axis, std::int32_t low,
                      BlockKeys& keys) {
  const std::byte* at = block.positions + axis * sizeof(std::int32_t);
  for (std::size_t i = 0; i < block.count; ++i, at += block.position_stride) {
    std::uint32_t coordinate;
    std::memcpy(&coordinate, at, sizeof(coordinate));
    keys[i] = coordinate - static_cast<std::uint32_t>(low);
  }
}

}  // namespace cairn::stages
