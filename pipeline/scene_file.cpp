#include "pipeline/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "formats/meshes/mesh.h"
#include "formats/toml_text.h"
#include "pipeline/checked_table.h"
#include "pipeline/scene_effects.h"
#include "pipeline/scene_shapes.h"

namespace cairn::pipeline {
namespace {

using formats::Vector3;
using stages::Raster;

constexpr std::uint64_t kMostRepeats = 100'000;
constexpr std::string_view kPoint = "three numbers: [x, y, z]";
constexpr std::string_view kTurn = "three angles in degrees: [yaw, pitch, roll]";

/// Calls use(name suffix, shift) for each copy that `repeat` asks for.
template <typename Use>
void for_each_copy(CheckedTable& table, Use use) {
  const auto count = table.find("repeat", "a whole number from 1 to 100000", [](const auto& node) {
    return whole_number(node, 1, kMostRepeats);
  });
  const auto step = table.find("repeat_step", kPoint, vector3);
  if (count && *count > 1 && !step) table.refuse("repeat asks for a repeat_step");
  if (step && !count) table.refuse("repeat_step asks for a repeat");
  table.finish();
  const std::uint64_t copies = count.value_or(1);
  const std::size_t width = fmt::format("{}", copies).size();
  for (std::uint64_t i = 0; i < copies; ++i) {
    Vector3 shift{};
    for (std::size_t axis = 0; axis < 3 && step; ++axis)
      shift[axis] = (*step)[axis] * static_cast<double>(i);
    use(count ? fmt::format("_{:0{}}", i + 1, width) : std::string(), shift);
  }
}

/// The position of a table, moved.
Vector3 moved(const Vector3& position, const Vector3& shift) {
  return {position[0] + shift[0], position[1] + shift[1], position[2] + shift[2]};
}

stages::Quaternion read_turn(CheckedTable& table, std::string_view key) {
  const Vector3 angles = table.find(key, kTurn, vector3).value_or(Vector3{});
  return stages::turned(angles[0], angles[1], angles[2]);
}

void read_walk(CheckedTable& table, stages::SceneObject& object) {
  const auto walk = table.find("walk", kPoint, vector3);
  const auto time = table.find("walk_time", "a time above 0", positive_number);
  if (walk.has_value() != time.has_value()) table.refuse("walk and walk_time ask for each other");
  object.walk = walk.value_or(object.walk);
  object.walk_time = time.value_or(object.walk_time);
}

/// Beams pass through objects for one stretch.
void refuse_leaves_that_cannot_be(const CheckedTable& table, const stages::SceneObject& object) {
  if (object.leaf_area_density == 0) return;
  if (dynamic_cast<const stages::ConvexSolid*>(object.shape.get()) == nullptr)
    table.refuse("leaf_area_density asks for a box, a sphere or a cylinder");
  if (object.walk != Vector3{}) table.refuse("leaf_area_density and walk exclude each other");
}

void read_object(CheckedTable table, const std::filesystem::path& folder, stages::Scene& scene) {
  stages::SceneObject object;
  object.shape = read_shape(table, folder);
  object.paint = read_paint(table);
  object.leaf_area_density = table.find("leaf_area_density", "a number above 0", positive_number)
                                 .value_or(object.leaf_area_density);
  read_walk(table, object);
  refuse_leaves_that_cannot_be(table, object);
  const Vector3 position = table.find("position", kPoint, vector3).value_or(Vector3{});
  const stages::Quaternion turn = read_turn(table, "rotation");
  for_each_copy(table, [&](const std::string&, const Vector3& shift) {
    object.pose = stages::pose_at(moved(position, shift), turn);
    scene.objects.push_back(object);
  });
}

/// Two ascending numbers within bounds and at most 360 apart.
auto range_within(double least, double most) {
  return [=](const toml::node& node) -> std::optional<std::array<double, 2>> {
    const auto ends = numbers(node);
    if (!ends || ends->size() != 2) return std::nullopt;
    const double begin = ends->front(), end = ends->back();
    if (!(least <= begin && begin < end && end <= most && end - begin <= 360)) return std::nullopt;
    return std::array<double, 2>{begin, end};
  };
}

std::optional<std::array<std::uint64_t, 2>> two_counts(const toml::node& node) {
  const toml::array* items = node.as_array();
  if (items == nullptr || items->size() != 2) return std::nullopt;
  const auto columns = whole_number((*items)[0], 1, stages::kMostCells);
  const auto rows = whole_number((*items)[1], 1, stages::kMostCells);
  if (!columns || !rows) return std::nullopt;
  return std::array<std::uint64_t, 2>{*columns, *rows};
}

/// As many whole steps as come nearest to filling the range.
std::uint64_t steps_in(const CheckedTable& table, double range, double step) {
  const double count = std::max(1.0, std::round(range / step));
  if (!(count <= static_cast<double>(stages::kMostCells)))
    table.refuse(fmt::format("step is {}, which divides the range into more than {} parts", step,
                             stages::kMostCells));
  return static_cast<std::uint64_t>(count);
}

Raster read_raster(CheckedTable& table) {
  Raster raster;
  const auto azimuth =
      table.find("azimuth", "two ascending angles from -360 to 360, at most 360 degrees apart",
                 range_within(-360, 360));
  const auto elevation =
      table.find("elevation", "two ascending angles from -90 to 90 degrees", range_within(-90, 90));
  if (azimuth) raster.azimuth_begin = azimuth->front(), raster.azimuth_end = azimuth->back();
  if (elevation)
    raster.elevation_begin = elevation->front(), raster.elevation_end = elevation->back();
  const auto counts =
      table.find("counts", "two whole numbers from 1 to 1048576: [columns, rows]", two_counts);
  const auto step = table.find("step", "an angle above 0, in degrees", positive_number);
  if (counts.has_value() == step.has_value())
    table.refuse("one of step and counts is needed, not both");
  if (counts) {
    raster.columns = counts->front();
    raster.rows = counts->back();
  } else {
    raster.columns = steps_in(table, raster.azimuth_end - raster.azimuth_begin, *step);
    raster.rows = steps_in(table, raster.elevation_end - raster.elevation_begin, *step);
  }
  return raster;
}

void read_station(CheckedTable table, std::size_t number, stages::Scene& scene) {
  stages::Station station;
  const std::string name =
      table.find("name", kPlainName, plain_name).value_or(fmt::format("station_{:02}", number));
  const Vector3 position = table.need("position", kPoint, vector3);
  station.turn = read_turn(table, "heading");
  station.raster = read_raster(table);
  station.max_range = table
                          .find("max_range", "a length above 0, at most 1e9",
                                [](const toml::node& node) {
                                  const auto range = positive_number(node);
                                  return range && *range <= 1e9 ? range : std::nullopt;
                                })
                          .value_or(station.max_range);
  for_each_copy(table, [&](const std::string& suffix, const Vector3& shift) {
    station.name = name + suffix;
    station.position = moved(position, shift);
    scene.stations.push_back(station);
  });
}

void read_output(CheckedTable table, SceneFile& scene) {
  const auto one_of = [](const auto&... allowed) {
    return [=](const toml::node& node) -> std::optional<std::string> {
      auto text = any_text(node);
      if (!text || !((*text == allowed) || ...)) return std::nullopt;
      return text;
    };
  };
  scene.format =
      table.find("format", "\"ply\" or \"las\"", one_of("ply", "las")).value_or(scene.format);
  const auto frame =
      table.find("frame", "\"sensor\" or \"world\"", one_of("sensor", "world")).value_or("sensor");
  scene.frame = frame == "world" ? stages::ScanFrame::kWorld : stages::ScanFrame::kSensor;
  table.finish();
}

/// The tables of [[key]], which must be there unless the scene has a base.
Tables tables_of(CheckedTable& table, std::string_view key, bool has_base) {
  const std::string allowed = fmt::format("at least one table [[{}]]", key);
  return has_base ? table.find(key, allowed, some_tables).value_or(Tables{})
                  : table.need(key, allowed, some_tables);
}

void refuse_equal_names(const CheckedTable& table, const stages::Scene& scene) {
  std::set<std::string> names;
  for (const stages::Station& station : scene.stations)
    if (!names.insert(station.name).second)
      table.refuse("two stations have the name " + station.name);
}

/// The objects and stations that a scene begins with: those of its base, if it names one.
stages::Scene read_base(CheckedTable& table, const std::filesystem::path& folder) {
  const auto base = table.find("base", "the path of a scene, a .toml file", any_text);
  if (!base) return {};
  const std::filesystem::path file = folder / *base;
  const std::string text = formats::read_toml_text(file);
  if (formats::parse_toml(text, file.string()).contains("base"))
    table.refuse("base: " + file.string() + " has a base itself");
  return parse_scene(text, file).scene;
}

}  // namespace

SceneFile parse_scene(std::string_view text, const std::filesystem::path& file) {
  const toml::table root = formats::parse_toml(text, file.string());
  CheckedTable table(root, file, "");
  SceneFile scene;
  scene.name = table.find("name", kPlainName, plain_name).value_or(plain_stem(file, "scene"));
  const auto output = table.find("output", "a table [output]", any_table);
  const auto effects = table.find("effects", "a table [effects]", any_table);
  scene.scene = read_base(table, file.parent_path());
  const auto objects = tables_of(table, "object", table.has("base"));
  const auto stations = tables_of(table, "station", table.has("base"));
  table.finish();
  if (output) read_output({**output, file, "output"}, scene);
  if (effects) scene.effects = read_effects(**effects, file);
  for (std::size_t i = 0; i < objects.size(); ++i)
    read_object({*objects[i], file, fmt::format("object {}", i + 1)}, file.parent_path(),
                scene.scene);
  const std::size_t of_base = scene.scene.stations.size();
  for (std::size_t i = 0; i < stations.size(); ++i)
    read_station({*stations[i], file, fmt::format("station {}", i + 1)}, of_base + i + 1,
                 scene.scene);
  refuse_equal_names(table, scene.scene);
  return scene;
}

SceneFile read_scene(const std::filesystem::path& file) {
  return parse_scene(formats::read_toml_text(file), file);
}

}  // namespace cairn::pipeline
