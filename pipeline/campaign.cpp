#include "pipeline/campaign.h"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "formats/error.h"
#include "formats/scans/pose_file.h"
#include "pipeline/distinct_files.h"
#include "pipeline/human.h"
#include "pipeline/memory_budget.h"

namespace cairn::pipeline {
namespace {

// What an import by one worker holds beside its reader: the program, and blocks of points. Measured.
constexpr std::uint64_t kImportBytes = std::uint64_t{36} << 20;

/// The poses of a campaign's scans, each used by one scan.
class Poses {
 public:
  Poses(const std::filesystem::path& path, bool tell_sensors_only)
      : file_(path), path_(path), tell_sensors_only_(tell_sensors_only) {}

  const formats::PoseFile::Entry& find(const std::filesystem::path& scan) {
    const formats::PoseFile::Entry& entry = file_.find(scan);
    if (tell_sensors_only_ && !entry.tells_sensor)
      formats::throw_usage(
          fmt::format("poses_tell: the poses of {} do not tell where sensors stood",
                      path_.filename().string()));
    const auto [user, is_first] = users_.emplace(&entry, scan);
    if (!is_first)
      formats::throw_input({.what = fmt::format("the pose {} is found for two scans", entry.scan),
                            .path = path_,
                            .found = user->second.string() + " and " + scan.string(),
                            .expected = "a pose for each"});
    return entry;
  }

 private:
  formats::PoseFile file_;
  std::filesystem::path path_;
  bool tell_sensors_only_;
  std::map<const formats::PoseFile::Entry*, std::filesystem::path> users_;
};

/// A reader that needs more memory than there is, such as the worker process of LAZ, is refused before it starts.
void require_reading_memory(const formats::ScanReader& scan, std::uint64_t memory_bytes) {
  if (memory_bytes == 0) return;
  require_memory(fmt::format("reading {} ({})", scan.info().name(), scan.info().format),
                 scan.read_bytes() + kImportBytes, memory_bytes);
}

/// One position cannot be that of several sensors.
void require_one_scan(const stages::Scans& scans) {
  if (scans.size() != 1)
    formats::throw_usage(fmt::format("one pose is given for the {} scans of {}", scans.size(),
                                     scans.front()->info().path.filename().string()));
}

}  // namespace

stages::Scans open_campaign(const CampaignOptions& options) {
  require_distinct_files(options.scans);
  if (options.scans.empty()) formats::throw_usage("no scans are given");
  if (options.poses_tell_sensors_only && !options.poses)
    formats::throw_usage("poses_tell: no poses are given that could tell where sensors stood");
  std::optional<Poses> poses;
  if (options.poses) poses.emplace(*options.poses, options.poses_tell_sensors_only);
  stages::Scans scans;
  for (const std::filesystem::path& path : options.scans) {
    formats::ScanOptions how{.allow_truncated = options.allow_truncated,
                             .columns = options.columns};
    const formats::PoseFile::Entry* entry = poses ? &poses->find(path) : nullptr;
    if (entry != nullptr && !options.poses_tell_sensors_only) how.pose = entry->pose;
    stages::Scans opened = formats::open_scans(path, how);
    if (entry != nullptr) require_one_scan(opened);
    for (auto& scan : opened) {
      require_reading_memory(*scan, options.memory_bytes);
      if (entry != nullptr && entry->tells_sensor) scan->set_sensor(entry->pose.translation);
      scans.push_back(std::move(scan));
    }
  }
  return scans;
}

}  // namespace cairn::pipeline
