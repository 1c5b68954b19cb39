#include "pipeline/measure_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "pipeline/geometry_report.h"
#include "pipeline/human.h"
#include "pipeline/json_number.h"
#include "pipeline/picture_report.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using stages::AttributeError;
using stages::LevelError;

constexpr int kDigits = 4;

/// How many times the bound is what it has to be.
std::string looseness_of(const LevelError& level) {
  return level.largest > 0 ? significant(level.bound / level.largest, 3) : "-";
}

std::string distance_table(const std::vector<LevelError>& levels) {
  std::string text = fmt::format(
      "\nDistance from the points that stand for them, in units of the coordinates\n"
      "  {:>5}  {:>9}  {:>13}  {:>10}  {:>11}  {:>10}  {:>10}  {:>15}\n",
      "level", "nodes", "points", "rms", "99 % within", "largest", "bound", "bound / largest");
  for (const LevelError& level : levels)
    text += fmt::format("  {:>5}  {:>9}  {:>13}  {:>10}  {:>11}  {:>10}  {:>10}  {:>15}{}\n",
                        level.level, with_commas(level.nodes), with_commas(level.points),
                        significant(level.rms, kDigits), significant(level.percentile_99, kDigits),
                        significant(level.largest, kDigits), significant(level.bound, kDigits),
                        looseness_of(level), level.broken_bounds > 0 ? "  BROKEN" : "");
  return text;
}

std::string attribute_table(const std::vector<LevelError>& levels) {
  if (levels.empty() || levels.front().attributes.empty()) return {};
  std::string heading = fmt::format("  {:>5}", "level");
  for (const AttributeError& attribute : levels.front().attributes) {
    const std::string unit = attribute.unit.empty() ? "" : ", " + attribute.unit;
    heading += fmt::format("  {:>24}", printable(attribute.name) + unit);
  }
  std::string text =
      "\nDeviation of attributes: rms, then the largest, in their own units\n" + heading + "\n";
  for (const LevelError& level : levels) {
    text += fmt::format("  {:>5}", level.level);
    for (const AttributeError& attribute : level.attributes)
      text += fmt::format("  {:>24}", attribute.compared == 0
                                          ? "-"
                                          : significant(attribute.rms, kDigits) + " / " +
                                                significant(attribute.largest, kDigits));
    text += "\n";
  }
  return text;
}

Json level_json(const LevelError& level) {
  Json attributes = Json::array();
  for (const AttributeError& attribute : level.attributes)
    attributes.push_back({{"name", attribute.name},
                          {"unit", attribute.unit.empty() ? Json(nullptr) : Json(attribute.unit)},
                          {"compared", attribute.compared},
                          {"rms", attribute.rms},
                          {"largest", attribute.largest}});
  return {{"level", level.level},
          {"nodes", level.nodes},
          {"points", level.points},
          {"rms", level.rms},
          {"percentile_99", level.percentile_99},
          {"largest", level.largest},
          {"bound", level.bound},
          {"broken_bounds", level.broken_bounds},
          {"cover_factor", finite_or_null(level.cover_factor)},
          {"attributes", std::move(attributes)},
          {"geometry", geometry_json(level.geometry)}};
}

/// How many points were searched for, and where they are from.
std::string sample_line(const stages::ErrorReport& report) {
  const auto& surface =
      report.levels.empty() ? report.leaves.surface : report.levels.front().geometry.surface;
  if (!surface) return {};
  const char* from = report.leaves.surface ? "the scans" : "the leaves";
  if (!surface->nearest.rms_interval)
    return fmt::format("  all {} of {} searched for on each level\n",
                       count_of(surface->sampled, "point"), from);
  return fmt::format(
      "  {} of {} searched for on each level; of all points the figures are within the "
      "ranges with 95 %\n",
      count_of(surface->sampled, "point"), from);
}

}  // namespace

std::string measure_text(const stages::ErrorReport& report, const std::filesystem::path& folder) {
  std::string text =
      fmt::format("{}\n  {}, all of them compared on each level\n", printable(folder.string()),
                  count_of(report.leaf_points, "leaf point"));
  text += report.leaf_displacement == 0
              ? "  leaves hold the positions of their input\n"
              : fmt::format("  leaves hold positions at most {} from those of their input\n",
                            significant(report.leaf_displacement, kDigits));
  text += sample_line(report);
  if (report.levels.empty())
    text += "  there is no level above the leaves\n";
  else
    text += distance_table(report.levels) + attribute_table(report.levels);
  return text + geometry_text(report);
}

std::string measure_json(const stages::ErrorReport& report, const PictureReport* pictures) {
  Json levels = Json::array();
  for (const LevelError& level : report.levels) levels.push_back(level_json(level));
  Json json{{"held", report.held()},
            {"leaf_points", report.leaf_points},
            {"leaf_displacement", report.leaf_displacement},
            {"levels", std::move(levels)},
            {"leaves", geometry_json(report.leaves)}};
  if (pictures != nullptr) json["pictures"] = pictures_json(*pictures);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void require_held(const stages::ErrorReport& report) {
  if (!report.held())
    throw formats::Error(formats::ErrorKind::kInvariant,
                         {.what = "points are farther from those that stand for them than the "
                                  "dataset's bounds allow"});
}

}  // namespace cairn::pipeline
