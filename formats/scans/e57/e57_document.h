// What the XML section of an E57 file tells: its scans, each with the fields of its records.
// Based on: ASTM E2807-11, "Standard Specification for 3D Imaging Data Exchange", 2011, sections 6 and 8.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/scans/e57/page_file.h"
#include "formats/scans/pose.h"

namespace cairn::formats {

/// One value of a record, which has a stream of bytes of its own.
struct E57Field {
  enum class Kind : std::uint8_t {
    kInteger,  ///< `bits` bits above `minimum`; the value is scale * it + offset
    kFloat32,
    kFloat64,
    kString,
  };

  std::string name;  ///< as in the file, with its prefix: "cartesianX", "nor:normalX"
  Kind kind = Kind::kFloat64;
  std::int64_t minimum = 0;  ///< kInteger, before scale and offset
  std::int64_t maximum = 0;
  double scale = 1;
  double offset = 0;
  /// Least and greatest value as the file tells it, after scale and offset; none for floats that tell none.
  std::optional<std::array<double, 2>> bounds;

  /// Of a record, 0 to 64; 0 for strings, which have no width.
  unsigned bits() const;
  bool is_number() const { return kind != Kind::kString; }
  /// Whether all values are whole numbers of 64 bits.
  bool is_whole() const { return kind == Kind::kInteger && scale == 1 && offset == 0; }
  /// The name without its prefix.
  std::string_view local_name() const;
};

struct E57Scan {
  std::optional<Pose> pose;
  std::uint64_t section_offset = 0;  ///< physical
  std::uint64_t records = 0;
  std::vector<E57Field> fields;  ///< in the order of their streams
  /// "las:..." beside the points or in them: it was made of a LAS file.
  bool has_las_elements = false;
  /// Of red, green and blue.
  std::array<std::optional<std::array<double, 2>>, 3> color_limits;
  std::optional<std::array<double, 2>> intensity_limits;
};

struct E57Document {
  std::string coordinate_metadata;  ///< perhaps empty
  std::vector<E57Scan> scans;
  std::size_t images = 0;
};

/// Reads and checks the XML section. Throws kInput where it is not there, is larger than is sane, is damaged, has a
/// document type (which may define entities), or describes records that cannot be read.
E57Document read_e57_document(const PageFile& file);

}  // namespace cairn::formats
