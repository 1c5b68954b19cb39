#include "pipeline/simulate.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/output_file.h"
#include "formats/scans/scan_writer.h"
#include "formats/toml_text.h"
#include "pipeline/config.h"
#include "pipeline/locked_folder.h"
#include "pipeline/memory_budget.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPoses = "poses.tsv";
constexpr const char* kCampaign = "campaign.toml";
/// How every campaign.toml of simulate begins, which tells its folders from those of others.
constexpr std::string_view kMadeBy = "# Made by cairn simulate from the scene ";

/// The files that a campaign of simulate consists of, by its campaign.toml; none if that is not simulate's.
std::set<std::string> files_of_campaign(const fs::path& folder) {
  const std::string text = formats::read_toml_text(folder / kCampaign);
  if (!text.starts_with(kMadeBy)) return {};
  std::set<std::string> files{kPoses, kCampaign};
  const SettingLayer told = parse_config(text, (folder / kCampaign).string(), {});
  if (const auto scans = told.find("scans"); scans != told.end())
    files.insert(scans->second.values.begin(), scans->second.values.end());
  return files;
}

/// Throws kUsage for a folder that holds anything that simulate does not make.
void require_campaign_or_nothing(const fs::path& output) {
  if (!fs::exists(fs::symlink_status(output))) return;
  const std::string refusal =
      "--force replaces simulated campaigns only, and " + output.string() + " ";
  if (!fs::is_directory(output) || fs::is_symlink(output))
    formats::throw_usage(refusal + "is not a folder");
  for (const char* needed : {kPoses, kCampaign})
    if (!fs::is_regular_file(output / needed)) formats::throw_usage(refusal + "holds no " + needed);
  const std::set<std::string> files = files_of_campaign(output);
  if (files.empty())
    formats::throw_usage(refusal + "holds a " + kCampaign + " that simulate did not make");
  for (const auto& entry : fs::directory_iterator(output)) {
    const std::string name = entry.path().filename().string();
    if (!files.contains(name) || entry.symlink_status().type() != fs::file_type::regular)
      formats::throw_usage(refusal + "holds " + name + ", which is no part of one");
  }
}

void write_text_file(const fs::path& path, const std::string& text) {
  formats::OutputFile::create(path).append(std::as_bytes(std::span(text.data(), text.size())));
}

/// Numbers in the shortest form that reads back as they are.
std::string poses_text(const SceneFile& scene, const SimulateReport& report) {
  std::string text = "scan\ttx\tty\ttz\tqw\tqx\tqy\tqz\n";
  for (std::size_t i = 0; i < report.stations.size(); ++i) {
    const stages::Station station =
        stages::StationEffects(scene.effects, i).recorded(scene.scene.stations[i]);
    const auto& [x, y, z] = station.position;
    const auto& [qw, qx, qy, qz] = station.turn;
    text += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\n", report.stations[i].file, x, y, z, qw,
                        qx, qy, qz);
  }
  return text;
}

std::string campaign_text(const SceneFile& scene, const SimulateReport& report,
                          const std::string& name) {
  std::string text = fmt::format("{}{}.\nscans = [\n", kMadeBy, scene.name);
  for (const StationReport& station : report.stations)
    text += fmt::format("  \"{}\",\n", station.file);
  text += fmt::format("]\nposes = \"{}\"\n", kPoses);
  if (scene.frame == stages::ScanFrame::kWorld) text += "poses_tell = \"sensors\"\n";
  // The escapes of a JSON string are escapes of TOML too.
  return text + "output = " + nlohmann::json("../" + name + ".cairn").dump() + "\n";
}

StationReport simulate_station(const SceneFile& scene, std::size_t number,
                               const stages::Context& context, const fs::path& folder) {
  const stages::Station& station = scene.scene.stations[number];
  const stages::StationEffects effects(scene.effects, number);
  StationReport report{.station = station.name,
                       .file = station.name + "." + scene.format,
                       .columns = station.raster.columns,
                       .rows = station.raster.rows,
                       .rays = station.raster.rays()};
  const auto description =
      stages::describe_station(effects.recorded(station), scene.frame,
                               /*steps=*/scene.format == "las", effects.most_echoes());
  const auto writer =
      formats::create_scan_writer(folder / report.file, description, description.claimed_points);
  const stages::ScanCounts counts =
      stages::scan_station(context, scene.scene.objects, station, effects, scene.frame, description,
                           [&](const formats::PointBlock& block) { writer->write(block); });
  report.points = counts.points;
  report.effect_calls = counts.effect_calls;
  if (report.points == 0)
    formats::throw_input({.what = "no ray of " + station.name + " hits anything",
                          .expected = "an object within its max_range and its raster"});
  writer->finish();
  report.bytes = fs::file_size(folder / report.file);
  return report;
}

/// The folder in which the campaign is made, inside that which is held for the time being.
fs::path make_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), 0777) != 0)
    formats::throw_system("cannot make the folder", path, errno);
  return path;
}

}  // namespace

SimulateReport simulate(const SceneFile& scene_file, const SimulateOptions& options,
                        stages::ProgressSink* progress, const std::stop_token& stop) {
  const auto begin = std::chrono::steady_clock::now();
  const fs::path output = formats::without_trailing_slash(options.output);
  require_free_place(output, options.force);
  require_campaign_or_nothing(output);
  SceneFile scene = scene_file;
  const stages::Context context{.threads = options.threads,
                                .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                .make_array = {},
                                .progress = progress,
                                .stop = stop};
  if (options.points) stages::scale_to_points(context, *options.points, scene.effects, scene.scene);
  const LockedFolder work(output.string() + ".scans.work", "simulation of " + output.string());
  const fs::path folder = make_folder(work.path() / "campaign");
  std::uint64_t rays = 0;
  for (const stages::Station& station : scene.scene.stations) rays += station.raster.rays();
  if (progress != nullptr) progress->begin("simulate", rays);
  SimulateReport report;
  for (std::size_t i = 0; i < scene.scene.stations.size(); ++i)
    report.stations.push_back(simulate_station(scene, i, context, folder));
  if (progress != nullptr) progress->end();
  write_text_file(folder / kPoses, poses_text(scene, report));
  write_text_file(folder / kCampaign, campaign_text(scene, report, output.filename().string()));
  require_campaign_or_nothing(output);
  // Scans that were simulated can be simulated again: no note is kept of where the old ones step aside.
  if (options.force && fs::exists(fs::symlink_status(output)))
    publish_over(
        folder, output, [](const fs::path&) {}, Renames::of_system());
  else
    publish_new(folder, output);
  report.elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace cairn::pipeline
