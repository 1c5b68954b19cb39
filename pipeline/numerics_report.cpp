#include "pipeline/numerics_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/human.h"
#include "pipeline/json_number.h"

namespace cairn::pipeline {

using Json = nlohmann::ordered_json;

namespace {

constexpr int kDigits = 4;

Json flat_axes(const Json& grid) {
  Json axes = Json::array();
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (grid.at("min").at(axis) == grid.at("max").at(axis))
      axes.push_back(std::string(1, "xyz"[axis]));
  return axes;
}

Json scans_json(const Json& sources) {
  Json scans = Json::array();
  for (const Json& source : sources)
    scans.push_back({{"name", source.at("name")},
                     {"precision", source.at("precision")},
                     {"rounding", source.at("rounding")}});
  return scans;
}

/// A level's points are made by one merging for each node of the next.
Json levels_json(const Json& told) {
  Json levels = Json::array();
  for (std::size_t i = 0; i < told.size(); ++i) {
    Json level{
        {"level", told.at(i).at("level")},
        {"mergings", i + 1 < told.size() ? told.at(i + 1).at("nodes") : Json(std::uint64_t{0})}};
    level.update(told.at(i).at("numerics"));
    levels.push_back(std::move(level));
  }
  return levels;
}

std::string axes_line(const Json& axes) {
  if (axes.empty()) return "  every axis has an extent\n";
  std::string names;
  for (const Json& axis : axes)
    names += (names.empty() ? "" : ", ") + printable(axis.get<std::string>());
  return fmt::format("  without extent: {}\n", names);
}

std::string figure(const Json& value) { return significant(value.get<double>(), kDigits); }

std::string scans_table(const Json& scans) {
  std::string text = fmt::format("  {:>12}  {:>16}  {:>12}  {}\n", "precision", "largest rounding",
                                 "rms rounding", "scan");
  for (const Json& scan : scans)
    text += fmt::format("  {:>12}  {:>16}  {:>12}  {}\n", figure(scan.at("precision")),
                        figure(scan.at("rounding").at("largest")),
                        figure(scan.at("rounding").at("rms")),
                        printable(scan.at("name").get<std::string>()));
  return text;
}

std::string error_text(const Json& error) {
  if (error.at("bound").get<double>() == 0) return "exact";
  return figure(error.at("largest")) + " of " + figure(error.at("bound"));
}

std::string levels_table(const Json& levels) {
  std::string text =
      fmt::format("  {:>5}  {:>9}  {:>13}  {:>14}  {:>17}  {:>24}  {:>24}  {:>16}\n", "level",
                  "mergings", "theta relaxed", "grid coarsened", "normals cancelled",
                  "position error of bound", "radius error of bound", "normal, degrees");
  for (const Json& level : levels) {
    const auto count = [&](const char* key) { return with_commas(whole_number(level.at(key))); };
    const Json& errors = level.at("quantization");
    text += fmt::format("  {:>5}  {:>9}  {:>13}  {:>14}  {:>17}  {:>24}  {:>24}  {:>16}\n",
                        whole_number(level.at("level")), count("mergings"), count("relaxed_theta"),
                        count("coarsened_grid"), count("cancelled_normals"),
                        error_text(errors.at("position")), error_text(errors.at("radius")),
                        error_text(errors.at("normal_degrees")));
  }
  return text;
}

}  // namespace

Json numerics_json(const Json& metadata) {
  const Json& levels = metadata.at("levels");
  if (levels.empty() || !levels.at(0).contains("numerics")) return nullptr;
  return {{"flat_axes", flat_axes(metadata.at("grid"))},
          {"scans", scans_json(metadata.at("sources"))},
          {"levels", levels_json(levels)}};
}

std::string numerics_text(const Json& numerics) {
  if (numerics.is_null()) return "";
  return "\nNumerics: what arithmetic did to the points\n" + axes_line(numerics.at("flat_axes")) +
         scans_table(numerics.at("scans")) + levels_table(numerics.at("levels"));
}

}  // namespace cairn::pipeline
