// Which neighbouring ranges one request fetches: what lies side by side in a file costs one round trip, and a gap that is
// smaller than a request's own bytes is cheaper fetched than spared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/access/byte_source.h"

namespace cairn::formats {

struct CoalesceLimits {
  /// A request and the head of its answer take about 600 bytes, and a connection rests for a round trip.
  std::uint64_t gap_bytes = 2048;
  /// Of a request that joins ranges: what is more urgent would wait for all of it. A single range may be larger.
  std::uint64_t request_bytes = 256 << 10;
  /// All gaps of a request, at most one byte for so many that are wanted.
  std::uint64_t wanted_per_gap_byte = 16;
};

/// A run of ranges: [first, end) of those given.
struct RangeRun {
  std::size_t first = 0;
  std::size_t end = 0;
};

/// The run around ranges[at] that one request fetches. Requires ranges in ascending order that do not overlap, and an `at`
/// among them.
RangeRun run_around(std::span<const ByteRange> ranges, std::size_t at,
                    const CoalesceLimits& limits);

}  // namespace cairn::formats
