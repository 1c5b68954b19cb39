// The interface of all scan writers: points in, a file of a common format out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "formats/point_block.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// Writes beside PATH and gives the file its name when it is finished, see PartFile. A writer that is destroyed
/// before leaves nothing behind, and what had the name stays as it was.
class ScanWriter {
 public:
  virtual ~ScanWriter() = default;

  /// Appends the points of a block, in order. The block's encoding and columns are those of the description.
  /// Throws kSystem if the file cannot be written, kUsage for a value that the format cannot hold.
  virtual void write(const PointBlock& block) = 0;

  /// Completes the header, makes the file durable and gives it its name. To be called once, last.
  virtual void finish() = 0;
};

/// A format that scans can be written in: a line of the table in scan_writer.cpp and a writer.
struct ScanFormat {
  using Create = std::unique_ptr<ScanWriter> (*)(const std::filesystem::path& path,
                                                 const ScanInfo& description,
                                                 std::uint64_t expected_points, bool replace);

  std::string_view name;  ///< "las"
  std::span<const std::string_view>
      suffixes;  ///< in lower case, with the dot; the first is the usual one
  bool takes_steps =
      false;  ///< keeps a grid's steps if positions come as kSteps; else kFloat64 is as good
  Create create = nullptr;
};

std::span<const ScanFormat> scan_formats();
/// The format of this name; null if there is none.
const ScanFormat* scan_format_named(std::string_view name);
/// The format that a file of this name is written in, by its suffix in any case; null for other suffixes.
const ScanFormat* scan_format_of(const std::filesystem::path& path);

/// Creates a writer of `format`. Of `description` the schema, the
/// encoding, scale, offset (kSteps: world = offset + scale * step) and crs are used. At most
/// `expected_points` points may be written. What stands at `path` when the writer finishes is replaced if `replace`
/// is given, else finish() throws kUsage and it stays.
///
/// LAS needs kSteps (else kUsage). It is LAS 1.2 with point format 0 to 3 where that holds everything; LAS
/// 1.4 for waveforms, near infrared, 16-bit scan angles, values that formats 0 to 5 have no bits for (those
/// may come late: the file is then converted), attributes that LAS has no field for (these become extra
/// bytes), more than 2^32 - 1 points, or a CRS in WKT alone. 8-bit colours are written times 257.
/// Point formats 6 to 10 say that the CRS is in WKT, as the specification demands; a CRS that is known as
/// GeoTIFF keys alone is written as those keys all the same.
///
/// PLY is binary little-endian with world coordinates as doubles; a CRS stands in a comment, see crs_text.
/// Attributes of several components get one property each, NAME_0, NAME_1, ...; 64-bit integers, which PLY
/// lacks, are written as doubles if that is exact, else refused (kUsage), as are more properties than the PLY
/// reader takes.
///
/// Texts have a line of names, which are those of PLY, and a line a point; separated by blanks, or by commas where the
/// suffix is .csv. Coordinates on a grid whose step and offset are decimal fractions are written as the decimals that
/// they are (see DecimalAxis); all other numbers in the shortest form that reads back the same. A CRS stands in a
/// comment before the names, but in CSV, which knows no comments. kUsage for more columns than the text reader takes.
std::unique_ptr<ScanWriter> create_scan_writer(const ScanFormat& format,
                                               const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace = false);
/// In the format that the suffix of `path` tells (kUsage for others).
std::unique_ptr<ScanWriter> create_scan_writer(const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace = false);

}  // namespace cairn::formats
