// A column: one attribute of all points of a node, as interleaved little-endian scalars. It is what a
// section of the dataset holds, and what filters turn into something smaller.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/schema.h"

namespace cairn::formats {

struct ColumnShape {
  ScalarType type = ScalarType::kU8;
  std::uint32_t components = 1;  ///< 1 to 255 scalars a point
  std::size_t count = 0;         ///< points

  std::size_t scalar_bytes() const { return cairn::formats::size_bytes(type); }
  std::size_t point_bytes() const { return scalar_bytes() * components; }
  /// Bytes of the whole column. A count comes from a checked index and memory for the column exists
  /// already, so the product cannot overflow.
  std::size_t size_bytes() const { return point_bytes() * count; }
};

}  // namespace cairn::formats
