#include "formats/dataset/node_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "formats/bytes.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/quantize.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

void quantize_positions(const PositionQuantizer& quantizer, std::vector<GridPoint>& positions) {
  std::vector<std::uint32_t> codes(positions.size() * 3);
  quantizer.encode(positions, codes);
  quantizer.decode(codes, positions);
}

bool normals_are_estimated(const Schema& schema) {
  const auto normal = normal_attribute(schema);
  return normal && schema[*normal].estimated;
}

}  // namespace

std::optional<std::size_t> normal_attribute(const Schema& schema) {
  for (std::size_t i = 0; i < schema.size(); ++i)
    if (schema[i].rule == ReduceRule::kNormal) return i;
  return std::nullopt;
}

NodeFrame::NodeFrame(const DatasetHeader& header, bool leaf)
    : position_bits_(leaf && header.lossless_leaves ? std::uint8_t{32} : header.position_bits),
      normals_exact_(leaf && header.lossless_leaves && !normals_are_estimated(header.schema)),
      radii_exact_(leaf && header.lossless_leaves && header.radius_origin == RadiusOrigin::kInput) {
}

NodeFrame NodeFrame::fit(const DatasetHeader& header, bool leaf, const NodeData& points) {
  CAIRN_CHECK(points.count() > 0 && points.radius.size() == points.count());
  NodeFrame frame(header, leaf);
  for (const GridPoint& p : points.position) frame.position_box_.add(p);
  const auto [least, most] = std::ranges::minmax(points.radius);
  CAIRN_CHECK(
      std::ranges::all_of(points.radius, [](float r) { return std::isfinite(r) && r >= 0; }));
  frame.radius_min_ = least;
  frame.radius_max_ = most;
  return frame;
}

NodeFrame NodeFrame::of(const DatasetHeader& header, bool leaf, const NodeRecord& record) {
  NodeFrame frame(header, leaf);
  frame.position_box_ = record.position_box;
  frame.radius_min_ = record.radius_min;
  frame.radius_max_ = record.radius_max;
  return frame;
}

bool NodeFrame::positions_exact() const {
  return PositionQuantizer(position_box_, position_bits_).exact();
}

double NodeFrame::displacement_bound(const Grid& grid) const {
  const PositionQuantizer quantizer(position_box_, position_bits_);
  if (quantizer.exact()) return 0;
  double squares = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = grid.step[static_cast<std::size_t>(axis)] * quantizer.max_error_steps(axis);
    squares += d * d;
  }
  // Six roundings of at most 2^-53 each, doubled for good measure.
  return std::sqrt(squares) * (1 + 12 * std::numeric_limits<double>::epsilon());
}

std::vector<float> NodeFrame::quantized_radii(std::vector<float> radii) const {
  if (radii_exact_) return radii;
  const RadiusQuantizer quantizer(radius_min_, radius_max_);
  for (float& radius : radii) radius = quantizer.decode(quantizer.encode(radius));
  return radii;
}

void NodeFrame::quantize(const Schema& schema, NodeData& points) const {
  const PositionQuantizer positions(position_box_, position_bits_);
  if (!positions.exact()) quantize_positions(positions, points.position);
  points.radius = quantized_radii(std::move(points.radius));
  if (normals_exact_) return;
  for (std::size_t i = 0; i < points.attributes.size(); ++i)
    if (schema[i].rule == ReduceRule::kNormal && !points.attributes[i].empty())
      points.attributes[i] = decode_normal_column(
          encode_normal_column(points.attributes[i], schema[i].type), schema[i].type);
}

}  // namespace cairn::formats
