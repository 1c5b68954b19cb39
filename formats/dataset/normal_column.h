// Columns of normals, float32 or float64 x 3 as the schema has them, to and from 16-bit codes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/dataset/normal_map.h"
#include "formats/schema.h"

namespace cairn::formats {

/// The normal at `index` of a column, as float32. Requires type kF32 or kF64 and index within the column.
Normal normal_at(std::span<const std::byte> column, ScalarType type, std::size_t index);

/// One code a normal; `column` holds 3 values of `type` (kF32 or kF64) each.
std::vector<std::uint16_t> encode_normal_column(std::span<const std::byte> column, ScalarType type);
/// The reverse.
std::vector<std::byte> decode_normal_column(std::span<const std::uint16_t> codes, ScalarType type);

}  // namespace cairn::formats
