// Simulates a campaign: scene in, a folder of scans out, with all that `cairn build` needs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "pipeline/scene_file.h"
#include "stages/context.h"

namespace cairn::pipeline {

struct SimulateOptions {
  std::filesystem::path output;         ///< the folder to make
  std::optional<std::uint64_t> points;  ///< scale all rasters to give about as many; at most 1e12
  unsigned threads = 1;
  bool force = false;
};

struct StationReport {
  std::string station;
  std::string file;
  std::uint64_t columns = 0, rows = 0;
  std::uint64_t rays = 0, points = 0, bytes = 0;
  stages::EffectCalls effect_calls{};
};

struct SimulateReport {
  std::vector<StationReport> stations;
  double elapsed_s = 0;
};

/// Makes `output` with a scan a station, NAME.ply or NAME.las; poses.tsv, which tells where the stations stood;
/// and campaign.toml, for `cairn build`, whose dataset stands beside the folder. All is made in OUTPUT.scans.work and
/// appears in one step. Throws Error: kUsage if something stands at `output` and `force` is not given, or if it is
/// no folder that simulate made; kInput if no ray of a station hits anything; kSystem as the disk does.
SimulateReport simulate(const SceneFile& scene, const SimulateOptions& options,
                        stages::ProgressSink* progress, const std::stop_token& stop);

std::string simulate_text(const SimulateReport& report, const std::filesystem::path& output);
std::string simulate_json(const SimulateReport& report, const std::filesystem::path& output);

}  // namespace cairn::pipeline
