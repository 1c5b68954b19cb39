#include "pipeline/scene_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "formats/meshes/mesh.h"
#include "stages/simulate/statue.h"

namespace cairn::pipeline {
namespace {

using formats::Vector3;
using stages::ShapePtr;

constexpr std::string_view kLength = "a length above 0";

/// An array of `Count` numbers above 0.
template <std::size_t Count>
std::optional<std::array<double, Count>> lengths(const toml::node& node) {
  const auto values = numbers(node);
  if (!values || values->size() != Count ||
      !std::all_of(values->begin(), values->end(), [](double x) { return x > 0; }))
    return std::nullopt;
  std::array<double, Count> result{};
  std::copy(values->begin(), values->end(), result.begin());
  return result;
}

/// At least two points, each apart from the one before.
std::optional<std::vector<Vector3>> line_of_points(const toml::node& node) {
  const toml::array* items = node.as_array();
  if (items == nullptr || items->size() < 2) return std::nullopt;
  std::vector<Vector3> points;
  for (const toml::node& item : *items) {
    const auto point = vector3(item);
    if (!point || (!points.empty() && points.back() == *point)) return std::nullopt;
    points.push_back(*point);
  }
  return points;
}

std::optional<std::string> mesh_path(const toml::node& node) {
  const auto path = any_text(node);
  return path && formats::is_mesh_path(*path) ? path : std::nullopt;
}

ShapePtr read_plane(CheckedTable& table, const std::filesystem::path&) {
  const auto size = table.need("size", "two lengths above 0: [along x, along y]", lengths<2>);
  return stages::make_plane(size[0], size[1]);
}

ShapePtr read_box(CheckedTable& table, const std::filesystem::path&) {
  return stages::make_box(table.need("size", "three lengths above 0: [x, y, z]", lengths<3>));
}

ShapePtr read_sphere(CheckedTable& table, const std::filesystem::path&) {
  return stages::make_sphere(table.need("radius", kLength, positive_number));
}

ShapePtr read_cylinder(CheckedTable& table, const std::filesystem::path&) {
  const double radius = table.need("radius", kLength, positive_number);
  return stages::make_cylinder(radius, table.need("height", kLength, positive_number));
}

ShapePtr read_tube(CheckedTable& table, const std::filesystem::path&) {
  const auto points = table.need(
      "points", "an array of at least two points [x, y, z], each apart from the one before",
      line_of_points);
  return stages::make_tube(points, table.need("radius", kLength, positive_number));
}

ShapePtr read_statue(CheckedTable& table, const std::filesystem::path&) {
  return std::make_shared<stages::Statue>(table.need("height", kLength, positive_number));
}

ShapePtr read_mesh_shape(CheckedTable& table, const std::filesystem::path& folder) {
  const std::string path = table.need("path", "the path of a .ply or .obj mesh", mesh_path);
  const double scale = table.find("scale", "a factor above 0", positive_number).value_or(1);
  formats::Mesh mesh = formats::read_mesh(folder / path);
  for (Vector3& vertex : mesh.vertices)
    for (double& value : vertex) value *= scale;
  return stages::make_mesh(std::move(mesh));
}

using ReadShape = ShapePtr (*)(CheckedTable& table, const std::filesystem::path& folder);
constexpr auto kShapes = std::to_array<std::pair<std::string_view, ReadShape>>({
    {"plane", read_plane},
    {"box", read_box},
    {"sphere", read_sphere},
    {"cylinder", read_cylinder},
    {"tube", read_tube},
    {"statue", read_statue},
    {"mesh", read_mesh_shape},
});

std::optional<ReadShape> shape_named(const toml::node& node) {
  const auto name = any_text(node);
  for (const auto& [known, read] : kShapes)
    if (name == known) return read;
  return std::nullopt;
}

std::optional<stages::Pattern> pattern(const toml::node& node) {
  const auto name = any_text(node);
  if (name == "plain") return stages::Pattern::kPlain;
  if (name == "checker") return stages::Pattern::kChecker;
  if (name == "gradient") return stages::Pattern::kGradient;
  return std::nullopt;
}

}  // namespace

ShapePtr read_shape(CheckedTable& table, const std::filesystem::path& folder) {
  const ReadShape read =
      table.need("type", "plane, box, sphere, cylinder, tube, statue or mesh", shape_named);
  return read(table, folder);
}

std::optional<stages::Rgb> any_color(const toml::node& node) {
  const toml::array* items = node.as_array();
  if (items == nullptr || items->size() != 3) return std::nullopt;
  stages::Rgb result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = whole_number((*items)[i], 0, 255);
    if (!value) return std::nullopt;
    result[i] = static_cast<std::uint8_t>(*value);
  }
  return result;
}

stages::Paint read_paint(CheckedTable& table) {
  stages::Paint paint;
  paint.first = table.find("color", kColor, any_color).value_or(paint.first);
  paint.pattern =
      table.find("pattern", "plain, checker or gradient", pattern).value_or(paint.pattern);
  const auto second = table.find("color2", kColor, any_color);
  const auto size = table.find("pattern_size", "a length above 0", positive_number);
  if (second && paint.pattern == stages::Pattern::kPlain)
    table.refuse("color2 asks for a pattern: checker or gradient");
  if (size && paint.pattern != stages::Pattern::kChecker)
    table.refuse("pattern_size asks for the pattern checker");
  paint.second = second.value_or(paint.second);
  paint.cube_size = size.value_or(paint.cube_size);
  return paint;
}

}  // namespace cairn::pipeline
