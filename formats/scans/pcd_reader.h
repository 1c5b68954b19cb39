// Reads PCD, the format of the Point Cloud Library: ascii, binary, and binary_compressed, which is one LZF block
// of all points, field by field.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/pcd_header.h"
#include "formats/scans/row_layout.h"
#include "formats/scans/scan_reader.h"
#include "formats/scans/text_rows.h"

namespace cairn::formats {

class PcdReader : public ScanReader {
 public:
  /// Opens and checks the file; passes once over the points of an ascii one. A packed `rgb` or `rgba` becomes
  /// `color`, the fourth byte of `rgba` `alpha`. The viewpoint tells the sensor's position and moves no point: PCL
  /// writes points that lie in the world already, and its own readers hand it out beside them. Throws kInput for a
  /// damaged header, for one without x, y and z, for sizes of compressed data that cannot be, for more binary points
  /// than the header claims, and for fewer points unless `options.allow_truncated` (compressed points are kept all
  /// or none).
  PcdReader(const std::filesystem::path& path, const ScanOptions& options);

  std::size_t stretch_count() const override;
  std::uint64_t stretch_capacity(std::size_t stretch) const override;
  std::uint64_t read_bytes() const override;
  void read(std::size_t stretch, const BlockSink& sink) const override;

 private:
  void lay_out();
  std::uint64_t count_points(const ScanOptions& options);
  std::uint64_t count_ascii(const ScanOptions& options);
  std::uint64_t count_compressed();
  void read_ascii(const TextStretch& stretch, const BlockSink& sink) const;
  void read_compressed(const BlockSink& sink) const;
  void parse_row(const LineReader& lines, std::byte* row) const;

  RandomAccessFile file_;
  PcdHeader header_;
  RowLayout layout_;
  std::size_t values_ = 0;  ///< scalars of a point, padding included
  Separator separator_ = Separator::kBlanks;
  std::vector<TextStretch> stretches_;  ///< of an ascii file
  std::uint32_t packed_bytes_ = 0;      ///< of a compressed file
  std::uint32_t unpacked_bytes_ = 0;
};

}  // namespace cairn::formats
