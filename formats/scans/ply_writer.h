// Writes binary little-endian PLY; see create_scan_writer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/part_file.h"
#include "formats/scans/component_names.h"
#include "formats/scans/scan_writer.h"

namespace cairn::formats {

class PlyWriter : public ScanWriter {
 public:
  PlyWriter(std::filesystem::path path, const ScanInfo& description, std::uint64_t expected_points,
            bool replace);

  void write(const PointBlock& block) override;
  void finish() override;

 private:
  /// One property behind the position; 64-bit integers are written as doubles.
  struct Property : NamedComponent {
    std::size_t offset_bytes = 0;  ///< in the row
  };

  void plan_properties();
  std::string header(std::uint64_t points) const;
  void encode_positions(const PointBlock& block, std::size_t first, std::size_t count);
  void encode_property(const Property& property, const PointBlock& block, std::size_t first,
                       std::size_t count);
  template <typename Integer>
  void encode_wide_integers(const Property& property, const std::byte* from, std::size_t count);

  std::filesystem::path path_;
  ScanInfo description_;
  std::uint64_t expected_points_;
  std::vector<Property> properties_;
  std::size_t row_size_bytes_ = 0;
  PartFile part_;
  std::uint64_t points_ = 0;
  std::vector<std::byte> rows_;  ///< on their way to the file
};

}  // namespace cairn::formats
