// The interface of all scan writers: points in, a file of a common format out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

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

enum class ScanFormat { kLas, kPly };

/// The format that a file of this name is written in, by its suffix in any case; nothing for other suffixes.
std::optional<ScanFormat> scan_format_of(const std::filesystem::path& path);

/// Creates a writer by the suffix of `path`, .las or .ply (kUsage for others). Of `description` the schema, the
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
/// PLY is binary little-endian with world coordinates as doubles; it has no CRS, so that is not written.
/// Attributes of several components get one property each, NAME_0, NAME_1, ...; 64-bit integers, which PLY
/// lacks, are written as doubles if that is exact, else refused (kUsage), as are more properties than the PLY
/// reader takes.
std::unique_ptr<ScanWriter> create_scan_writer(const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace = false);

}  // namespace cairn::formats
