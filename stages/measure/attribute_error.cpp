#include "stages/measure/attribute_error.h"

#include <array>
#include <cmath>
#include <numbers>

#include "formats/scalar_value.h"

namespace cairn::stages {
namespace {

using formats::Attribute;
using formats::ReduceRule;
using Direction = std::array<double, 3>;

double dot(const Direction& a, const Direction& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double angle_degrees(const Direction& a, const Direction& b) {
  const Direction cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                        a[0] * b[1] - a[1] * b[0]};
  return std::atan2(std::sqrt(dot(cross, cross)), dot(a, b)) * (180 / std::numbers::pi);
}

bool is_direction(const Direction& a) {
  const double square = dot(a, a);
  return square > 0 && std::isfinite(square);
}

void add_angle(const Attribute& attribute, const std::byte* leaf, const std::byte* above,
               Deviation& deviation) {
  const std::size_t size = formats::size_bytes(attribute.type);
  Direction a, b;
  for (std::size_t k = 0; k < 3; ++k) {
    a[k] = formats::load_scalar(leaf + k * size, attribute.type);
    b[k] = formats::load_scalar(above + k * size, attribute.type);
  }
  if (!is_direction(a) || !is_direction(b)) return;
  const double angle = angle_degrees(a, b);
  deviation.add(angle * angle);
}

void add_differences(const Attribute& attribute, const std::byte* leaf, const std::byte* above,
                     Deviation& deviation) {
  const std::size_t size = formats::size_bytes(attribute.type);
  for (std::size_t k = 0; k < attribute.components; ++k) {
    const double difference = formats::load_scalar(leaf + k * size, attribute.type) -
                              formats::load_scalar(above + k * size, attribute.type);
    if (std::isfinite(difference * difference)) deviation.add(difference * difference);
  }
}

}  // namespace

std::vector<MeasuredAttribute> measured_attributes(const formats::Schema& schema) {
  std::vector<MeasuredAttribute> measured;
  for (std::size_t i = 0; i < schema.size(); ++i)
    if (schema[i].rule == ReduceRule::kMean || schema[i].rule == ReduceRule::kNormal)
      measured.push_back({i, schema[i]});
  return measured;
}

void add_deviations(const MeasuredAttribute& measured, const formats::NodeData& leaf,
                    const formats::NodeData& above, const std::vector<std::uint32_t>& stands_for,
                    Deviation& deviation) {
  const std::size_t size = measured.attribute.size_bytes();
  const std::byte* from = leaf.attributes[measured.index].data();
  const std::byte* to = above.attributes[measured.index].data();
  const auto add = measured.attribute.rule == ReduceRule::kNormal ? add_angle : add_differences;
  for (std::size_t i = 0; i < leaf.count(); ++i)
    add(measured.attribute, from + i * size, to + stands_for[i] * size, deviation);
}

}  // namespace cairn::stages
