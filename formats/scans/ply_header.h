// The header of a PLY file: its encoding, its elements and their properties.
// Based on: G. Turk, "The PLY Polygon File Format", 1994, and the sized type names that came later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/limits.h"
#include "formats/random_access_file.h"
#include "formats/schema.h"

namespace cairn::formats {

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };
std::string_view name_of(PlyEncoding encoding);

/// Properties of an element that are read and written: the position and as many as there may be attributes.
inline constexpr std::size_t kMaxPlyProperties = kMaxAttributes + 3;

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kF32;    ///< of the value, or of a list's items
  std::optional<ScalarType> count_type;  ///< of a list's length, an integer type; none for a scalar

  bool is_list() const { return count_type.has_value(); }
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  ///< as claimed
  std::vector<PlyProperty> properties;

  bool has_lists() const;
  /// Bytes of an instance in a binary file, lists taken as empty.
  std::size_t smallest_size_bytes() const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::string
      crs_comment;  ///< the first comment that tells a coordinate system, see crs.h; or empty
  std::uint64_t data_offset = 0;  ///< of the first byte behind the header

  /// Index of the element with this name, if there is one.
  std::optional<std::size_t> find(std::string_view name) const;
};

/// Reads the header, of at most 1 MiB. Accepts "\n" and "\r\n", comments and obj_info anywhere.
/// Throws kInput, with the offset of the line, for what it does not understand.
PlyHeader read_ply_header(const RandomAccessFile& file);

}  // namespace cairn::formats
