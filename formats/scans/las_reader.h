// Reads LAS 1.0 to 1.5, point formats 0 to 10, in stretches of a fixed number of records. Steps,
// scale and offset are kept as they are, so nothing is rounded.
#pragma once

#include <cstdint>
#include <filesystem>

#include "formats/random_access_file.h"
#include "formats/scans/las_header.h"
#include "formats/scans/las_layout.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// What LAS and LAZ have in common: fills `info`, except for the points present, from the header and the
/// records around the points, which end at `points_end`. Returns how a record is decoded. Throws as
/// read_las_records does.
LasLayout describe_las(const RandomAccessFile& file, const LasHeader& header,
                       std::uint64_t points_end, bool allow_truncated, ScanInfo& info);

class LasReader : public ScanReader {
 public:
  /// Opens and checks the file, which is not compressed. Throws kInput for a damaged one, and for one that
  /// ends, or whose EVLRs or waveform packets begin, before the last record that its header claims ends,
  /// unless `options.allow_truncated`.
  LasReader(const std::filesystem::path& path, const ScanOptions& options);

  std::size_t stretch_count() const override;
  std::uint64_t stretch_capacity(std::size_t stretch) const override;
  void read(std::size_t stretch, const BlockSink& sink) const override;

 private:
  /// Records between the header and what follows them. Throws kInput for fewer than are counted, unless that is allowed.
  std::uint64_t room_for_points(const ScanOptions& options) const;

  RandomAccessFile file_;
  LasHeader header_;
  LasLayout layout_;
};

}  // namespace cairn::formats
