#include "pipeline/geometry_report.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "pipeline/human.h"
#include "pipeline/json_number.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using stages::DistanceError;
using stages::ErrorReport;
using stages::GeometryError;
using stages::Interval;
using stages::SpacingError;
using stages::SurfaceError;

constexpr int kDigits = 4;

std::string number(double value) {
  return std::isfinite(value) ? significant(value, kDigits) : "none";
}
std::string percent(double share) { return significant(100 * share, 3); }

std::string in_brackets(const std::optional<Interval>& interval,
                        const std::function<std::string(double)>& shown) {
  return interval ? fmt::format("{} to {}", shown(interval->low), shown(interval->high))
                  : std::string("exact");
}

std::string distance_cells(const DistanceError& error) {
  return fmt::format("  {:>10}  {:>19}  {:>11}  {:>10}", number(error.rms),
                     in_brackets(error.rms_interval, number), number(error.percentile_99),
                     number(error.largest));
}

std::string distance_heading() {
  return fmt::format("  {:>5}  {:>10}  {:>19}  {:>11}  {:>10}\n", "level", "rms", "95 % certain",
                     "99 % within", "largest");
}

struct Line {
  formats::Level level;
  const GeometryError* geometry;
  double cover_factor;
};

std::vector<Line> lines_of(const ErrorReport& report) {
  std::vector<Line> lines;
  for (const stages::LevelError& level : report.levels)
    lines.push_back({level.level, &level.geometry, level.cover_factor});
  lines.push_back({static_cast<formats::Level>(lines.size()), &report.leaves, 1});
  return lines;
}

/// A heading and a line for each level of which `cells` says something; nothing if there is none.
std::string table(const std::vector<Line>& lines, const std::string& heading,
                  const std::function<std::string(const Line&)>& cells) {
  std::string rows;
  for (const Line& line : lines)
    if (const std::string text = cells(line); !text.empty())
      rows += fmt::format("  {:>5}{}\n", line.level, text);
  return rows.empty() ? rows : "\n" + heading + rows;
}

std::string cover_cells(const SurfaceError& s, double recorded) {
  return fmt::format("  {:>11}  {:>16}  {:>8}  {:>13}  {:>12}  {:>8}", percent(s.uncovered),
                     in_brackets(s.uncovered_interval, percent), significant(s.overdraw, 3),
                     number(s.factor_99_9), number(s.factor_all), number(recorded));
}

Json json_of(const std::optional<Interval>& interval) {
  return interval ? Json::array({interval->low, interval->high}) : Json(nullptr);
}

Json json_of(const DistanceError& error) {
  return {{"rms", error.rms},
          {"rms_interval", json_of(error.rms_interval)},
          {"percentile_99", error.percentile_99},
          {"largest", error.largest}};
}

Json json_of(const SurfaceError& error) {
  return {{"sampled", error.sampled},
          {"nearest", json_of(error.nearest)},
          {"splat", json_of(error.splat)},
          {"uncovered", error.uncovered},
          {"uncovered_interval", json_of(error.uncovered_interval)},
          {"overdraw", error.overdraw},
          {"factor_99_9", finite_or_null(error.factor_99_9)},
          {"factor_all", finite_or_null(error.factor_all)}};
}

Json json_of(const SpacingError& error) {
  return {{"sampled", error.sampled}, {"mean", error.mean}, {"variation", error.variation}};
}

template <typename T>
Json json_or_null(const std::optional<T>& value) {
  return value ? json_of(*value) : Json(nullptr);
}

}  // namespace

std::string geometry_text(const ErrorReport& report) {
  const std::vector<Line> lines = lines_of(report);
  const auto distances = [&](const char* what, const auto& error_of) {
    return table(lines,
                 fmt::format("{}, in units of the coordinates\n{}", what, distance_heading()),
                 [&](const Line& line) {
                   const DistanceError* error = error_of(*line.geometry);
                   return error != nullptr ? distance_cells(*error) : std::string();
                 });
  };
  std::string text =
      distances("Distance from the nearest point of the level",
                [](const GeometryError& g) { return g.surface ? &g.surface->nearest : nullptr; });
  text += distances("Distance from the nearest splat of the level",
                    [](const GeometryError& g) { return g.surface ? &g.surface->splat : nullptr; });
  text += table(
      lines,
      fmt::format(
          "Cover by splats as spheres: share in none, mean number that one lies in, and the "
          "factor on all radii that\ncovers; recorded is what covers finer splats, level by "
          "level\n"
          "  {:>5}  {:>11}  {:>16}  {:>8}  {:>13}  {:>12}  {:>8}\n",
          "level", "uncovered %", "95 % certain", "overdraw", "factor 99.9 %", "factor 100 %",
          "recorded"),
      [](const Line& line) {
        return line.geometry->surface ? cover_cells(*line.geometry->surface, line.cover_factor)
                                      : std::string();
      });
  text += table(
      lines,
      fmt::format("Distance between neighboring points of the level, in units of the coordinates; "
                  "its variation is 0 of a lattice,\n0.52 at random in a plane\n"
                  "  {:>5}  {:>10}  {:>19}\n",
                  "level", "mean", "deviation / mean"),
      [](const Line& line) {
        const auto& spacing = line.geometry->spacing;
        return spacing ? fmt::format("  {:>10}  {:>19}", number(spacing->mean),
                                     significant(spacing->variation, 3))
                       : std::string();
      });
  return text + distances("Distance of the level's points from the true surface",
                          [](const GeometryError& g) { return g.truth ? &*g.truth : nullptr; });
}

Json geometry_json(const GeometryError& geometry) {
  return {{"surface", json_or_null(geometry.surface)},
          {"spacing", json_or_null(geometry.spacing)},
          {"truth", json_or_null(geometry.truth)}};
}

}  // namespace cairn::pipeline
