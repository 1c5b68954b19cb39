// Codes of the EPSG registry as ranges, for tables of what many codes have in common.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace cairn::formats {

/// Of a table no code that is not meant lies in a range, and codes that nobody has lie there at most 63 in a row.
struct EpsgRange {
  std::uint16_t first, last;
};

inline bool holds(std::span<const EpsgRange> ranges, std::uint16_t code) {
  return std::ranges::any_of(
      ranges, [=](const EpsgRange& range) { return range.first <= code && code <= range.last; });
}

}  // namespace cairn::formats
