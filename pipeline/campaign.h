// The scans of one job, with what must be known of them beside their files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "stages/import/import.h"

namespace cairn::pipeline {

struct CampaignOptions {
  std::vector<std::filesystem::path> scans;
  std::optional<std::filesystem::path> poses;  ///< a file of poses of all scans
  bool poses_tell_sensors_only = false;        ///< the scans lie in the world already
  bool allow_truncated = false;
  std::vector<std::string> columns;  ///< of texts, see formats::ScanOptions; empty: recognised
  std::uint64_t memory_bytes = 0;    ///< of the whole program; 0: no limit
};

/// Opens every scan, placed in the world. Throws Error as formats::open_scans and formats::PoseFile do, kInput
/// where one pose would serve two files, and kUsage where no scans are given or one is given twice, where reading
/// one takes more than the memory, where one sensor is told for a file of several scans, and for sensors alone
/// without poses that tell them.
stages::Scans open_campaign(const CampaignOptions& options);

}  // namespace cairn::pipeline
