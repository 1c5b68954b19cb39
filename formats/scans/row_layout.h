// Which scalars of a binary record become the position and which become attributes, and the loops that
// decode rows. Whatever its file, a record is first brought into one form: a row of fixed size with scalars
// at fixed offsets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/point_block.h"
#include "formats/random_access_file.h"
#include "formats/schema.h"

namespace cairn::formats {

struct RowLayout {
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

/// What a file says of a part of its records.
struct RowField {
  std::string name;
  ScalarType type = ScalarType::kF32;
  std::size_t offset_bytes = 0;  ///< in the row
  std::size_t components = 1;    ///< scalars of this type, one after the other; at least 1
};

/// Chooses position and attributes: x, y, z; nx, ny, nz of one floating type as `normal`; red,
/// green, blue (or r, g, b, or diffuse_red, ...) of one type uint8 or uint16 as `color`;
/// scalar_intensity as `intensity`; all others under their sanitised names, more than 255 components as
/// several attributes. Fills `schema` and `encoding`. Returns nothing if x, y or z is missing.
std::optional<RowLayout> make_row_layout(const std::vector<RowField>& fields,
                                         std::size_t row_size_bytes, Schema& schema,
                                         PositionEncoding& encoding);

/// Decodes whole rows into the points from `first` on of a block that was resized (resize_block) to
/// hold them. `big_endian` tells the byte order of the rows.
void decode_rows(const RowLayout& layout, const Schema& schema, bool big_endian,
                 std::span<const std::byte> rows, std::size_t first, PointBlock& block);

/// A run of rows in a file, all of one size.
struct RowRun {
  std::uint64_t first_byte = 0;
  std::uint64_t count = 0;
  bool big_endian = false;
};

/// Streams the points of a run in blocks. Throws kInput if the file ends before the run.
void read_rows(const RandomAccessFile& file, const RowRun& run, const RowLayout& layout,
               const Schema& schema, PositionEncoding encoding,
               const std::function<void(const PointBlock&)>& sink);

}  // namespace cairn::formats
