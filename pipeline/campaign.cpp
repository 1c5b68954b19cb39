#include "pipeline/campaign.h"

#include <utility>

#include "formats/error.h"
#include "formats/scans/pose_file.h"
#include "pipeline/distinct_files.h"

namespace cairn::pipeline {
namespace {

// The part of the memory that the reader of a scan may hold: the rest is for points and work arrays.
constexpr std::uint64_t kReadShare = 2;

}  // namespace

stages::Scans open_campaign(const CampaignOptions& options) {
  require_distinct_files(options.scans);
  if (options.scans.empty()) formats::throw_usage("no scans are given");
  std::optional<formats::PoseFile> poses;
  if (options.poses) poses.emplace(*options.poses);
  stages::Scans scans;
  for (const std::filesystem::path& path : options.scans) {
    formats::ScanOptions how{.allow_truncated = options.allow_truncated,
                             .columns = options.columns,
                             .read_memory_bytes = options.memory_bytes / kReadShare};
    const formats::PoseFile::Entry* entry = poses ? &poses->find(path) : nullptr;
    if (entry != nullptr && !options.poses_tell_sensors_only) how.pose = entry->pose;
    for (auto& scan : formats::open_scans(path, how)) {
      if (entry != nullptr && entry->tells_sensor) scan->set_sensor(entry->pose.translation);
      scans.push_back(std::move(scan));
    }
  }
  return scans;
}

}  // namespace cairn::pipeline
