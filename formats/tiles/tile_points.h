// The points of one tile of a 3D Tiles tileset, as columns of what glTF calls vertex attributes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/schema.h"

namespace cairn::formats {

/// One vertex attribute.
struct TileColumn {
  std::string semantic;  ///< POSITION, NORMAL, COLOR_0, or _NAME for an attribute of ours
  ScalarType type = ScalarType::kU16;  ///< kU8, kI8, kU16, kI16 or kF32: what glTF knows
  std::uint8_t components = 1;         ///< 1 or 3
  bool normalized = false;             ///< integers stand for 0 ... 1 or -1 ... 1
  /// For a point its components, then zeros up to stride_bytes().
  std::vector<std::byte> values;

  /// Bytes of a point: a multiple of 4, as glTF demands.
  std::size_t stride_bytes() const {
    return (cairn::formats::size_bytes(type) * components + 3) / 4 * 4;
  }
  friend bool operator==(const TileColumn&, const TileColumn&) = default;
};

/// Points whose positions are 16-bit codes: on each axis of the tile's frame, in which z points up,
/// coordinate = origin + scale * code.
struct TilePoints {
  std::size_t count = 0;
  std::array<double, 3> scale{1, 1, 1};   ///< metres a code; finite, > 0
  std::array<double, 3> origin{0, 0, 0};  ///< metres
  /// Columns with different semantics; the first is POSITION, kU16 x 3.
  std::vector<TileColumn> columns;

  friend bool operator==(const TilePoints&, const TilePoints&) = default;
};

}  // namespace cairn::formats
