#include "formats/dataset/node_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "formats/bytes.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/quantize.h"
#include "formats/error.h"
#include "formats/vector_path.h"

namespace cairn::formats {
namespace {

/// Replaces a column of normals by what is stored of them.
QuantizationError quantize_normals(ScalarType type, std::vector<std::byte>& column) {
  std::vector<std::byte> decoded = decode_normal_column(encode_normal_column(column, type), type);
  double least_cosine = 1;
  for (std::size_t i = 0; i < column.size() / (3 * size_bytes(type)); ++i) {
    const Normal a = normal_at(column, type, i), b = normal_at(decoded, type, i);
    double dot = 0, squared_a = 0, squared_b = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      dot += double{a[c]} * b[c];
      squared_a += double{a[c]} * a[c];
      squared_b += double{b[c]} * b[c];
    }
    if (squared_b > 0)
      least_cosine = std::min(least_cosine, dot / std::sqrt(squared_a * squared_b));
  }
  column = std::move(decoded);
  return {std::acos(least_cosine) * 180 / std::numbers::pi, kMaxNormalErrorDegrees};
}

/// The box of the positions, and the radii's extremes.
void measure(const NodeData& points, GridBox& box, float& radius_min, float& radius_max) {
  box = box_of(points.position);
  float least = std::numeric_limits<float>::infinity(), most = 0;
  bool valid = true;
#pragma omp simd reduction(min : least) reduction(max : most) reduction(& : valid)
  for (std::size_t i = 0; i < points.radius.size(); ++i) {
    const float radius = points.radius[i];
    valid &= radius >= 0 && radius <= std::numeric_limits<float>::max();
    least = radius < least ? radius : least;
    most = radius > most ? radius : most;
  }
  CAIRN_CHECK(valid);
  radius_min = least;
  radius_max = most;
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
  vectorized<measure>(points, frame.position_box_, frame.radius_min_, frame.radius_max_);
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

QuantizationError NodeFrame::quantize_positions(const Grid& grid,
                                                std::vector<GridPoint>& positions) const {
  const PositionQuantizer quantizer(position_box_, position_bits_);
  if (quantizer.exact()) return {};
  std::vector<GridPoint> decoded(positions.size());
  std::vector<std::uint32_t> codes(positions.size() * 3);
  quantizer.encode(positions, codes);
  quantizer.decode(codes, decoded);
  double most = 0;
  for (std::size_t i = 0; i < positions.size(); ++i)
    most = std::max(most, squared_distance(grid, positions[i], decoded[i]));
  positions = std::move(decoded);
  return {std::sqrt(most), displacement_bound(grid)};
}

std::vector<float> NodeFrame::quantized_radii(std::vector<float> radii) const {
  if (radii_exact_) return radii;
  const RadiusQuantizer quantizer(radius_min_, radius_max_);
  std::vector<std::uint8_t> codes(radii.size());
  quantizer.encode(radii, codes);
  quantizer.decode(codes, radii);
  return radii;
}

QuantizationError NodeFrame::quantize_radii(std::vector<float>& radii) const {
  if (radii_exact_) return {};
  std::vector<float> decoded = quantized_radii(radii);
  double most = 0;
  for (std::size_t i = 0; i < radii.size(); ++i)
    most = std::max(most, double{decoded[i]} - double{radii[i]});
  radii = std::move(decoded);
  return {most, double{RadiusQuantizer(radius_min_, radius_max_).max_error()}};
}

QuantizationErrors NodeFrame::quantize(const Schema& schema, const Grid& grid,
                                       NodeData& points) const {
  QuantizationErrors errors{.position = quantize_positions(grid, points.position),
                            .radius = quantize_radii(points.radius),
                            .normal = {}};
  if (normals_exact_) return errors;
  for (std::size_t i = 0; i < points.attributes.size(); ++i)
    if (schema[i].rule == ReduceRule::kNormal && !points.attributes[i].empty())
      errors.normal.add(quantize_normals(schema[i].type, points.attributes[i]));
  return errors;
}

}  // namespace cairn::formats
