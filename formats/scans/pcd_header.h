// The header of a PCD file, versions 0.5 to 0.7: https://pcl.readthedocs.io/projects/tutorials/en/latest/pcd_file_format.html
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/pose.h"
#include "formats/schema.h"

namespace cairn::formats {

enum class PcdEncoding : std::uint8_t { kAscii, kBinary, kCompressed };
std::string_view name_of(PcdEncoding encoding);

struct PcdField {
  std::string name;
  ScalarType type = ScalarType::kF32;
  std::size_t count = 1;  ///< scalars, at least 1

  /// Fields named "_" only keep others aligned.
  bool is_padding() const { return name == "_"; }
  std::size_t row_bytes() const { return count * size_bytes(type); }
};

struct PcdHeader {
  std::string version;
  std::vector<PcdField> fields;
  std::uint64_t points = 0;
  /// Where the sensor stood, unless the viewpoint is the default: no translation, no rotation.
  std::optional<Vector3> sensor;
  PcdEncoding encoding = PcdEncoding::kAscii;
  std::uint64_t data_offset = 0;  ///< of what follows the DATA line
  std::uint64_t data_line = 0;    ///< its number as a line
};

/// Reads and checks a header. POINTS tells the number of points; WIDTH x HEIGHT does where it is missing, and must
/// agree with it unless one of them is 0. Throws kInput for what is missing, damaged or contradictory, for a type
/// that does not exist, and for records of more than 1 MiB.
PcdHeader read_pcd_header(const RandomAccessFile& file);

/// Whether the beginning of a file is that of a PCD header.
bool begins_pcd(std::string_view beginning);

}  // namespace cairn::formats
