// Poses of a campaign's scans from a file beside them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/scans/pose.h"

namespace cairn::formats {

/// Which poses a campaign's scans have. Two forms are read:
///
/// * a table with a header line, separated by tabs, commas or blanks: columns `scan`, `tx`, `ty`, `tz`, `qw`, `qx`,
///   `qy`, `qz` in any order; world = R(q) p + t, and the sensor stands at t;
/// * the `.conf` of the Stanford 3D Scanning Repository: lines `bmesh FILE tx ty tz qx qy qz qw`, whose rotation is
///   the transpose of the usual one and which tells no sensor; other lines are passed over.
class PoseFile {
 public:
  /// Throws kSystem if the file cannot be read, kInput, naming the line, where it is neither form or tells a
  /// second pose of one scan.
  explicit PoseFile(const std::filesystem::path& path);

  struct Entry {
    std::string scan;
    Pose pose;
    bool tells_sensor = false;
  };

  /// The entry of a scan: the one that names its file, its stem, or the number in its stem if that is the only one
  /// ("12" for scan12_world.laz). Throws kInput, naming scan and pose file, if there is none.
  const Entry& find(const std::filesystem::path& scan) const;

 private:
  std::filesystem::path path_;
  std::vector<Entry> entries_;
};

}  // namespace cairn::formats
