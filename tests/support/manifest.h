// MANIFEST.tsv of the shared scans: what other programs found in each file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cairn::test {

struct ManifestEntry {
  std::string path;  ///< relative to the folder of the manifest
  std::string format;
  std::string attributes;               ///< "Imax=254 Rmax=240 classes=1 ..."
  std::optional<std::uint64_t> points;  ///< none where no reader could tell
  /// Least and greatest coordinates, and half a unit of the last digit that each is given with.
  struct Bound {
    double value = 0;
    double tolerance = 0;
  };
  std::optional<std::array<Bound, 6>> box;  ///< least x, y, z, greatest x, y, z

  bool is_hostile() const { return path.starts_with("hostile/"); }
};

/// Empty if there is no such file.
std::vector<ManifestEntry> read_manifest(const std::filesystem::path& file);

}  // namespace cairn::test
