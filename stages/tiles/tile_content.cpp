#include "stages/tiles/tile_content.h"

#include <algorithm>
#include <cmath>

#include "formats/bytes.h"
#include "formats/dataset/metadata.h"
#include "formats/dataset/quantize.h"
#include "formats/scalar_value.h"
#include "formats/tiles/glb_names.h"

namespace cairn::stages {
namespace {

using formats::Attribute;
using formats::NodeData;
using formats::ReduceRule;
using formats::ScalarType;
using formats::TileColumn;

constexpr unsigned kPositionBits = 16;

/// An empty column for `count` points.
TileColumn column_for(std::string semantic, ScalarType type, std::uint8_t components,
                      bool normalized, std::size_t count) {
  TileColumn column{.semantic = std::move(semantic),
                    .type = type,
                    .components = components,
                    .normalized = normalized};
  column.values.resize(count * column.stride_bytes());
  return column;
}

/// The type in which a tile stores a scalar: glTF has none of 32 bits or more but float32.
ScalarType tile_type(ScalarType type) {
  return formats::size_bytes(type) <= 2 ? type : ScalarType::kF32;
}

bool is_color(const Attribute& attribute) {
  return attribute.name == formats::attribute_name::kColor && attribute.components == 3 &&
         (attribute.type == ScalarType::kU8 || attribute.type == ScalarType::kU16);
}

std::uint16_t color_component(const std::byte* at, ScalarType type) {
  return type == ScalarType::kU8 ? std::to_integer<std::uint16_t>(*at)
                                 : formats::load_le<std::uint16_t>(at);
}

}  // namespace

formats::TileBox tile_box(const TileFrame& frame, const formats::GridBox& box) {
  formats::TileBox told;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = frame.metres(axis, box.min[axis]), high = frame.metres(axis, box.max[axis]);
    told.center[axis] = low + (high - low) / 2;
    told.half[axis] = (high - low) / 2 + frame.step_m[axis] / 2;
  }
  return told;
}

TileContentMaker::TileContentMaker(const formats::DatasetReader& dataset, const TileFrame& frame,
                                   bool normals, formats::ColorClient color_client)
    : dataset_(dataset), frame_(frame) {
  sections_.set(formats::kPositionSection).set(formats::kRadiusSection);
  choose_columns(normals);
  if (color_) linear_.emplace(bits_of_color(), color_client);
}

void TileContentMaker::choose_columns(bool normals) {
  const formats::Schema& schema = dataset_.header().schema;
  for (std::size_t i = 0; i < schema.size(); ++i) {
    const Attribute& attribute = schema[i];
    const bool on_all_levels = attribute.rule != ReduceRule::kNone;
    if (on_all_levels && is_color(attribute))
      color_ = i;
    else if (attribute.rule == ReduceRule::kNormal && normals && !normal_)
      normal_ = i;
    else if (on_all_levels && attribute.components == 1)
      properties_.push_back(i);
    else {
      left_out_.push_back(attribute.name);
      continue;
    }
    sections_.set(formats::kFirstAttributeSection + i);
  }
}

/// As the metadata tells it; datasets that were made before it did leave it to the root: 16 if one of its colours is brighter
/// than 8 bits can tell. Means of 8-bit values in wider fields never are.
unsigned TileContentMaker::bits_of_color() const {
  const Attribute& attribute = dataset_.header().schema[*color_];
  if (attribute.type == ScalarType::kU8) return 8;
  if (const auto bits = formats::read_metadata_color_bits(dataset_.metadata())) return *bits;
  const NodeData root = dataset_.read_node(
      formats::NodeId{0}, formats::SectionSet().set(formats::kFirstAttributeSection + *color_));
  const std::vector<std::byte>& values = root.attributes[*color_];
  for (std::size_t at = 0; at + 2 <= values.size(); at += 2)
    if (formats::load_le<std::uint16_t>(&values[at]) > 255) return 16;
  return 8;
}

std::uint64_t TileContentMaker::working_bytes() const {
  // A point: decoded with its sections, as columns of the tile, compressed, and once more as a file.
  std::uint64_t decoded = sizeof(formats::GridPoint) + sizeof(float), column = 8;
  for (std::size_t i = 0; i < dataset_.header().schema.size(); ++i)
    if (sections_.test(formats::kFirstAttributeSection + i)) {
      decoded += 2 * dataset_.header().schema[i].size_bytes();
      column += 8;
    }
  return dataset_.tree().node_points() * (2 * decoded + 3 * column);
}

TileContent TileContentMaker::make(formats::NodeId id) const {
  const NodeData node = dataset_.read_node(id, sections_);
  TileContent content;
  content.points.count = node.count();
  add_positions(node, content);
  double diameters = 0;
  for (const float radius : node.radius) diameters += 2 * static_cast<double>(radius);
  content.spacing_m = diameters / static_cast<double>(node.count()) * frame_.metres_per_unit;
  auto& columns = content.points.columns;
  if (normal_) columns.push_back(normal_column(node, content.points.scale));
  if (color_) columns.push_back(color_column(node));
  for (const std::size_t attribute : properties_)
    columns.push_back(property_column(node, attribute));
  return content;
}

void TileContentMaker::add_positions(const NodeData& node, TileContent& content) const {
  const formats::GridBox box = formats::box_of(node.position);
  const formats::PositionQuantizer quantizer(box, kPositionBits);
  std::vector<std::uint16_t> codes(3 * node.count());
  quantizer.encode(node.position, codes);
  TileColumn column =
      column_for(formats::kPositionSemantic, ScalarType::kU16, 3, false, node.count());
  for (std::size_t i = 0; i < codes.size(); ++i)
    formats::store_le(&column.values[i / 3 * column.stride_bytes() + i % 3 * 2], codes[i]);
  content.points.columns.push_back(std::move(column));

  double rounding_squared = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int a = static_cast<int>(axis);
    const double span = box.span(a);
    const double steps_a_code = quantizer.exact(a) ? 1 : span / quantizer.max_code(a);
    content.points.scale[axis] = frame_.step_m[axis] * steps_a_code;
    content.points.origin[axis] = frame_.metres(axis, box.min[axis]);
    const double most = quantizer.exact(a) ? 0 : content.points.scale[axis] / 2;
    rounding_squared += most * most;
  }
  content.rounding_m = std::sqrt(rounding_squared);
}

TileColumn TileContentMaker::color_column(const NodeData& node) const {
  const Attribute& attribute = dataset_.header().schema[*color_];
  const std::size_t width = formats::size_bytes(attribute.type);
  TileColumn column = column_for(formats::kColorSemantic, ScalarType::kU16, 3, true, node.count());
  for (std::size_t i = 0; i < 3 * node.count(); ++i) {
    const std::uint16_t value =
        color_component(&node.attributes[*color_][i * width], attribute.type);
    formats::store_le(&column.values[i / 3 * column.stride_bytes() + i % 3 * 2],
                      linear_->of(value));
  }
  return column;
}

/// Normals in the frame of the codes, which the node's matrix stretches: its inverse transpose makes of them those of the
/// surface in metres, which are not the dataset's where axes have several units.
TileColumn TileContentMaker::normal_column(const NodeData& node,
                                           const std::array<double, 3>& scale) const {
  const Attribute& attribute = dataset_.header().schema[*normal_];
  const std::size_t width = formats::size_bytes(attribute.type);
  TileColumn column = column_for(formats::kNormalSemantic, ScalarType::kI16, 3, true, node.count());
  for (std::size_t i = 0; i < node.count(); ++i) {
    std::array<double, 3> normal{};
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      normal[axis] =
          scale[axis] / frame_.unit_m[axis] *
          formats::load_scalar(&node.attributes[*normal_][(3 * i + axis) * width], attribute.type);
      squared += normal[axis] * normal[axis];
    }
    // glTF wants unit vectors, also of a point that has no normal.
    if (!(squared > 0) || !std::isfinite(squared)) normal = {0, 0, 1}, squared = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      formats::store_le(
          &column.values[i * column.stride_bytes() + axis * 2],
          static_cast<std::int16_t>(std::lround(normal[axis] / std::sqrt(squared) * INT16_MAX)));
  }
  return column;
}

TileColumn TileContentMaker::property_column(const NodeData& node, std::size_t index) const {
  const Attribute& attribute = dataset_.header().schema[index];
  const ScalarType type = tile_type(attribute.type);
  TileColumn column =
      column_for(formats::semantic_of(attribute.name), type, 1, false, node.count());
  for (std::size_t i = 0; i < node.count(); ++i) {
    const double value =
        formats::load_scalar(&node.attributes[index][i * attribute.size_bytes()], attribute.type);
    // glTF has no number for "no number".
    const bool fits = std::isfinite(value) && std::isfinite(static_cast<float>(value));
    formats::store_scalar(&column.values[i * column.stride_bytes()], type, fits ? value : 0);
  }
  return column;
}

}  // namespace cairn::stages
