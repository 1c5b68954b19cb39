// Writes texts of numbers, XYZ and CSV; see create_scan_writer.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/part_file.h"
#include "formats/scans/component_names.h"
#include "formats/scans/decimal_axis.h"
#include "formats/scans/scan_writer.h"

namespace cairn::formats {

class TextWriter : public ScanWriter {
 public:
  TextWriter(std::filesystem::path path, const ScanInfo& description, std::uint64_t expected_points,
             bool replace);

  void write(const PointBlock& block) override;
  void finish() override;

 private:
  std::string header() const;
  char* write_position(const PointBlock& block, std::size_t point, char* to) const;
  char* write_values(const PointBlock& block, std::size_t point, char* to) const;

  std::filesystem::path path_;
  ScanInfo description_;
  std::uint64_t expected_points_;
  bool commas_;
  std::vector<NamedComponent> components_;
  /// kSteps only: nothing for an axis whose coordinates are written as doubles.
  std::array<std::optional<DecimalAxis>, 3> axes_;
  PartFile part_;
  std::uint64_t points_ = 0;
  std::vector<char> lines_;  ///< on their way to the file
};

}  // namespace cairn::formats
