#include "viewer/dataset_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "formats/dataset/metadata.h"
#include "formats/dataset/node_frame.h"
#include "formats/dataset/normal_column.h"

namespace cairn::viewer {
namespace {

using formats::NodeData;

constexpr int kUp = 2;

void load_positions(const formats::Grid& grid, const Box& box, const NodeData& data,
                    std::vector<glm::vec3>& position) {
  glm::dvec3 origin;  // of the grid's steps, from the box's center: small numbers come first
  for (int axis = 0; axis < 3; ++axis) origin[axis] = grid.world(axis, 0) - box.center[axis];
  position.resize(data.count());
  for (std::size_t i = 0; i < data.count(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      position[i][axis] =
          static_cast<float>(origin[axis] + grid.step[axis] * data.position[i][axis]);
}

/// Of unit length, or zero.
glm::vec3 unit_normal(const formats::Normal& normal) {
  const glm::vec3 n(normal[0], normal[1], normal[2]);
  const float length = glm::length(n);
  return length > 0 && std::isfinite(length) ? n / length : glm::vec3(0);
}

std::uint32_t direction_color(const glm::vec3& normal) {
  const auto channel = [](float value) {
    return static_cast<std::uint32_t>(std::lround(127.5f + 127.5f * value));
  };
  return pack_color(channel(normal.x), channel(normal.y), channel(normal.z));
}

std::vector<double> heights(const formats::Grid& grid, const NodeData& data) {
  std::vector<double> values(data.count());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = grid.world(kUp, data.position[i][kUp]);
  return values;
}

void ramp_colors(const std::vector<double>& values, const ValueRange& range,
                 std::vector<std::uint32_t>& colors) {
  // Colors of a ramp differ by less than these steps do.
  static const std::array<std::uint32_t, 1024> ramp = [] {
    std::array<std::uint32_t, 1024> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = ramp_color(static_cast<double>(i) / (table.size() - 1));
    return table;
  }();
  const double scale = (ramp.size() - 1) / (range.greatest - range.least);
  colors.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = (values[i] - range.least) * scale;
    colors[i] =
        ramp[static_cast<std::size_t>(std::clamp(at >= 0 ? at : 0.0, 0.0, ramp.size() - 1.0))];
  }
}

}  // namespace

DatasetSource::DatasetSource(const formats::DatasetReader& dataset, const LodTree& tree,
                             const FramePlan& plan)
    : dataset_(dataset),
      tree_(tree),
      plan_(plan),
      columns_(columns_of(plan)),
      sections_(sections_of(plan, dataset.header())),
      normal_(formats::normal_attribute(dataset.header().schema)),
      color_(formats::find_attribute(dataset.header().schema, attribute_of(plan.color))) {
  if (color_ && dataset.header().schema[*color_].type == formats::ScalarType::kU8) color_bits_ = 8;
  const bool height = plan.color == ColorSource::kHeight;
  if (!height && !color_) return;
  const NodeData root = dataset.read_node(formats::NodeId{0}, sections_);
  const auto& header = dataset.header();
  if (height || root.attributes[*color_].empty()) {
    range_ = middle_range(heights(header.grid, root));
    return;
  }
  const auto& column = root.attributes[*color_];
  const formats::Attribute& attribute = header.schema[*color_];
  // Datasets that were made before the metadata told it leave it to the root's colors.
  if (plan.color == ColorSource::kColor)
    color_bits_ = formats::read_metadata_color_bits(dataset.metadata())
                      .value_or(color_bits(column, attribute));
  if (plan.color == ColorSource::kIntensity)
    range_ = middle_range(column_values(column, attribute));
}

void DatasetSource::load(NodeIndex node, NodePoints& points, const std::stop_token& stop) const {
  const NodeData data = dataset_.read_node(formats::NodeId{node}, sections_, stop);
  const auto& header = dataset_.header();
  load_positions(header.grid, tree_.node(node).box, data, points.position);
  points.radius.clear();
  if (columns_.radius) points.radius.assign(data.radius.begin(), data.radius.end());
  points.normal.clear();
  if (columns_.normal) {
    const auto& column = data.attributes[normal_.value()];
    points.normal.resize(data.count());
    for (std::size_t i = 0; i < data.count(); ++i)
      points.normal[i] =
          pack_normal(unit_normal(formats::normal_at(column, header.schema[*normal_].type, i)));
  }
  points.color.clear();
  if (columns_.color) load_colors(data, points);
}

void DatasetSource::listen(const std::function<void()>& arrived) const {
  wishes_.reset();
  if (is_remote() && arrived) wishes_ = dataset_.make_wishes(sections_, arrived);
}

void DatasetSource::expect(std::span<const NodeIndex> nodes) const {
  if (!wishes_) return;
  std::vector<formats::NodeId> ids;
  for (const NodeIndex node : nodes) ids.push_back(formats::NodeId{node});
  wishes_->replace(ids);
}

bool DatasetSource::ready(NodeIndex node) const {
  return !wishes_ || wishes_->ready(formats::NodeId{node});
}

void DatasetSource::load_colors(const NodeData& data, NodePoints& points) const {
  const auto& header = dataset_.header();
  if (plan_.color == ColorSource::kHeight)
    return ramp_colors(heights(header.grid, data), range_, points.color);
  if (plan_.color == ColorSource::kNormal) {
    points.color.resize(data.count());
    const auto& column = data.attributes[normal_.value()];
    for (std::size_t i = 0; i < data.count(); ++i)
      points.color[i] =
          direction_color(unit_normal(formats::normal_at(column, header.schema[*normal_].type, i)));
    return;
  }
  const formats::Attribute& attribute = header.schema[color_.value()];
  const auto& column = data.attributes[*color_];
  // Attributes of the leaves alone: what stands for their points further up is gray.
  if (column.empty()) return points.color.assign(data.count(), pack_color(150, 150, 150));
  if (plan_.color == ColorSource::kColor)
    return convert_colors(column, attribute, color_bits_, points.color);
  const std::vector<double> values = column_values(column, attribute);
  if (plan_.color == ColorSource::kIntensity) return ramp_colors(values, range_, points.color);
  points.color.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    points.color[i] = class_color(static_cast<std::uint32_t>(values[i]));
}

}  // namespace cairn::viewer
