// Where a split pass reads its records from: slabs of the import array, whose positions still need
// mapping to the dataset grid, or slabs of a work array, whose positions are grid steps already.
#pragma once

#include <algorithm>
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

/// Calls `visit(record bytes, grid position)` for each record of a slab, in order.
template <typename Visit>
void for_each_record(const Slab& slab, Visit&& visit) {
  const std::byte* record = slab.record(0);
  if (slab.map != nullptr) {
    for (std::uint64_t i = 0; i < slab.count; ++i, record += slab.stride)
      visit(record, slab.map->map(record));
    return;
  }
  for (std::uint64_t i = 0; i < slab.count; ++i, record += slab.stride) {
    formats::GridPoint position;
    std::memcpy(position.data(), record, 12);
    visit(record, position);
  }
}

}  // namespace cairn::stages
