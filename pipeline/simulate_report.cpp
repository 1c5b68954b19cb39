// What `cairn simulate` tells of its work.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/human.h"
#include "pipeline/simulate.h"

namespace cairn::pipeline {
namespace {

StationReport sum_of(const SimulateReport& report) {
  StationReport sum{.station = "all", .file = count_of(report.stations.size(), "file")};
  for (const StationReport& station : report.stations) {
    sum.rays += station.rays;
    sum.points += station.points;
    sum.bytes += station.bytes;
    for (std::size_t i = 0; i < stages::kEffects; ++i)
      sum.effect_calls[i] += station.effect_calls[i];
  }
  return sum;
}

/// A line for each effect that was called; nothing of an ideal scanner.
std::string effect_lines(const stages::EffectCalls& calls) {
  std::string lines;
  for (std::size_t i = 0; i < stages::kEffects; ++i)
    if (calls[i] > 0)
      lines += fmt::format("  effect {:<20} {:>15} calls\n", stages::kEffectNames[i],
                           with_commas(calls[i]));
  return lines;
}

nlohmann::ordered_json effects_json(const stages::EffectCalls& calls) {
  auto json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < stages::kEffects; ++i)
    json[std::string(stages::kEffectNames[i])] = calls[i];
  return json;
}

std::string row(const StationReport& station, std::size_t width, const std::string& raster) {
  return fmt::format("  {:<{}} {:>15} {:>14} {:>14} {:>10}  {}\n", station.station, width, raster,
                     with_commas(station.rays), with_commas(station.points),
                     human_bytes(station.bytes), station.file);
}

}  // namespace

std::string simulate_text(const SimulateReport& report, const std::filesystem::path& output) {
  const StationReport sum = sum_of(report);
  std::size_t width = 7;
  for (const StationReport& station : report.stations)
    width = std::max(width, station.station.size());
  std::string text =
      fmt::format("{}\n  {:<{}} {:>15} {:>14} {:>14} {:>10}  file\n", printable(output.string()),
                  "station", width, "raster", "rays", "points", "size");
  for (const StationReport& station : report.stations)
    text += row(station, width, fmt::format("{} x {}", station.columns, station.rows));
  if (report.stations.size() > 1) text += row(sum, width, "");
  text += effect_lines(sum.effect_calls);
  return text + fmt::format("  {:.3f} points a ray; {} in {}, {:.1f} M rays/s\n  cairn build {}\n",
                            static_cast<double>(sum.points) / static_cast<double>(sum.rays),
                            count_of(sum.rays, "ray"), human_duration(report.elapsed_s),
                            static_cast<double>(sum.rays) / report.elapsed_s / 1e6,
                            printable((output / "campaign.toml").string()));
}

std::string simulate_json(const SimulateReport& report, const std::filesystem::path& output) {
  using Json = nlohmann::ordered_json;
  Json stations = Json::array();
  for (const StationReport& station : report.stations)
    stations.push_back({{"station", station.station},
                        {"file", station.file},
                        {"columns", station.columns},
                        {"rows", station.rows},
                        {"rays", station.rays},
                        {"points", station.points},
                        {"bytes", station.bytes},
                        {"effect_calls", effects_json(station.effect_calls)}});
  const StationReport sum = sum_of(report);
  const Json json{{"output", output.string()},
                  {"campaign", (output / "campaign.toml").string()},
                  {"rays", sum.rays},
                  {"points", sum.points},
                  {"bytes", sum.bytes},
                  {"effect_calls", effects_json(sum.effect_calls)},
                  {"elapsed_s", report.elapsed_s},
                  {"stations", std::move(stations)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace cairn::pipeline
