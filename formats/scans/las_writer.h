// Writes LAS 1.2 or 1.4; see create_scan_writer for what is chosen when.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "formats/part_file.h"
#include "formats/scans/las_plan.h"
#include "formats/scans/scan_writer.h"

namespace cairn::formats {

class LasWriter : public ScanWriter {
 public:
  LasWriter(std::filesystem::path path, const ScanInfo& description, std::uint64_t expected_points,
            bool replace);

  void write(const PointBlock& block) override;
  void finish() override;

 private:
  /// Encodes and appends some points of a block, converting the file if a value asks for it.
  void append(const PointBlock& block, std::size_t first, std::size_t count);
  /// Writes all points again in a point format of 6 to 10.
  void convert_to_wide();
  void begin_file();
  void count_points(const PointBlock& block);

  std::filesystem::path path_;
  ScanInfo description_;
  std::uint64_t expected_points_;
  LasPlan plan_;
  PartFile part_;
  LasTotals totals_;
  std::vector<std::byte> records_;  ///< on their way to the file
};

}  // namespace cairn::formats
