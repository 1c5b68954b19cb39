// Which properties of a vertex become the position and which become attributes, and the loops that
// decode rows. Whatever its encoding, a vertex is first brought into one form: a row, the scalar
// properties one after the other without padding, lists left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/point_block.h"
#include "formats/scans/ply_header.h"
#include "formats/schema.h"

namespace cairn::formats {

struct PlyLayout {
  /// One scalar of a row and where it goes.
  struct Field {
    ScalarType type = ScalarType::kF32;
    std::size_t offset_bytes = 0;  ///< in the row
    std::size_t attribute = 0;     ///< index in the schema; unused for positions
    std::size_t component = 0;     ///< of the attribute, or axis of the position
  };

  std::array<Field, 3> position;
  std::vector<Field> fields;
  std::size_t row_size_bytes = 0;
};

/// Chooses position and attributes: x, y, z; nx, ny, nz of one floating type as `normal`; red,
/// green, blue (or r, g, b, or diffuse_red, ...) of one type uint8 or uint16 as `color`;
/// scalar_intensity as `intensity`; all others under their sanitised names. Fills `schema` and
/// `encoding`. Returns nothing if x, y or z is missing or a list.
std::optional<PlyLayout> make_ply_layout(const PlyElement& vertex, Schema& schema,
                                         PositionEncoding& encoding);

/// Decodes whole rows into the points from `first` on of a block that was resized (resize_block) to
/// hold them. `big_endian` tells the byte order of the rows.
void decode_ply_rows(const PlyLayout& layout, const Schema& schema, bool big_endian,
                     std::span<const std::byte> rows, std::size_t first, PointBlock& block);

}  // namespace cairn::formats
