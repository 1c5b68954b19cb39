#include "formats/dataset/quantize.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/error.h"
#include "formats/vector_path.h"
#include "formats/wide_int.h"

namespace cairn::formats {
namespace {

/// floor(dividend / divisor) for dividend < 2^63, given reciprocal = floor((2^64 - 1) / divisor) and
/// 1 <= divisor < 2^32.
///
/// Proof: reciprocal >= 2^64 / divisor - 1, so the estimate floor(dividend * reciprocal / 2^64) is above
/// dividend / divisor - dividend / 2^64 - 1 > dividend / divisor - 3/2, and never above the quotient.
/// So it is the quotient or one less, and the remainder tells which.
std::uint64_t divide(std::uint64_t dividend, std::uint64_t divisor, std::uint64_t reciprocal) {
  const auto estimate = static_cast<std::uint64_t>((Uint128{dividend} * reciprocal) >> 64);
  return estimate + (dividend - estimate * divisor >= divisor ? 1 : 0);
}

std::uint64_t reciprocal_of(std::uint64_t divisor) {
  return std::numeric_limits<std::uint64_t>::max() / divisor;
}

/// round(value * numerator / denominator), half up. The product is below 2^63 where it is used: both
/// factors of an inexact axis are below 2^32 and one of them is a code of at most 31 bits.
std::uint32_t scale(std::uint32_t value, std::uint64_t numerator, std::uint64_t denominator,
                    std::uint64_t reciprocal) {
  return static_cast<std::uint32_t>(
      divide(value * numerator + denominator / 2, denominator, reciprocal));
}

}  // namespace

PositionQuantizer::PositionQuantizer(const GridBox& box, unsigned bits) : box_(box), bits_(bits) {
  CAIRN_CHECK(bits >= 1 && bits <= 32);
  const auto largest_code = static_cast<std::uint32_t>((std::uint64_t{1} << bits) - 1);
  for (std::size_t a = 0; a < 3; ++a) {
    CAIRN_CHECK(box.min[a] <= box.max[a]);
    Axis& axis = axes_[a];
    axis.min = static_cast<std::uint32_t>(box.min[a]);
    axis.span = box.span(static_cast<int>(a));
    axis.exact = axis.span <= largest_code;
    axis.max_code = std::min(axis.span, largest_code);
    if (axis.exact) continue;
    axis.span_reciprocal = reciprocal_of(axis.span);
    axis.code_reciprocal = reciprocal_of(axis.max_code);
  }
}

std::uint32_t PositionQuantizer::max_error_steps(int axis) const {
  const Axis& a = axes_[static_cast<std::size_t>(axis)];
  if (a.exact) return 0;
  return static_cast<std::uint32_t>((std::uint64_t{a.span} + a.max_code) /
                                    (std::uint64_t{2} * a.max_code));
}

std::uint32_t PositionQuantizer::encode_step(const Axis& axis, std::int32_t min,
                                             std::int32_t step) {
  // The difference of two int32 fits in uint32 where step >= min.
  const std::uint32_t d =
      step < min ? 0 : std::min(static_cast<std::uint32_t>(step) - axis.min, axis.span);
  return axis.exact ? d : scale(d, axis.max_code, axis.span, axis.span_reciprocal);
}

std::int32_t PositionQuantizer::decode_code(const Axis& axis, std::uint32_t code) {
  const std::uint32_t d =
      axis.exact ? code : scale(code, axis.span, axis.max_code, axis.code_reciprocal);
  return static_cast<std::int32_t>(axis.min + d);
}

template <typename Code>
void PositionQuantizer::encode_all(std::span<const GridPoint> points, std::span<Code> codes) const {
  CAIRN_CHECK(codes.size() == points.size() * 3);
  CAIRN_CHECK(bits_ <= 8 * sizeof(Code));
  Code* out = codes.data();
  for (const GridPoint& p : points)
    for (std::size_t a = 0; a < 3; ++a)
      *out++ = static_cast<Code>(encode_step(axes_[a], box_.min[a], p[a]));
}

template <typename Code>
std::optional<std::size_t> PositionQuantizer::find_beyond(std::span<const Code> codes) const {
  CAIRN_CHECK(codes.size() % 3 == 0);
  std::array<std::uint32_t, 3> greatest{0, 0, 0};
  for (std::size_t i = 0; i < codes.size(); i += 3)
    for (std::size_t a = 0; a < 3; ++a)
      greatest[a] = std::max<std::uint32_t>(greatest[a], codes[i + a]);
  const auto beyond = [&](std::size_t axis, std::uint32_t code) {
    return code > axes_[axis].max_code;
  };
  if (!beyond(0, greatest[0]) && !beyond(1, greatest[1]) && !beyond(2, greatest[2]))
    return std::nullopt;
  std::size_t first = 0;
  while (!beyond(first % 3, codes[first])) ++first;
  return first;
}

namespace {

/// The numbers of some points, one after the other.
constexpr std::size_t kAtOnce = 16;
using Numbers = std::array<double, 3 * kAtOnce>;

/// Of 16-bit codes the step is, in each coordinate, min + floor((code * span + half) / max_code).
struct Scaling {
  Numbers min, span, half, max_code;
};

/// Rounds to an integer what is added to it and taken away again, if that is below 2^51.
constexpr double kRounder = 0x1.8p52;

/// In doubles, as scale() in integers. Numerators stay below 2^53. With half a one more, a quotient lies between two
/// integers and at least 2^-17 from both, so that rounding reaches neither; the lower one is the nearest of what is 1/2 less.
void scale_codes(const Scaling& scaling, std::span<const std::uint16_t> codes,
                 std::int32_t* steps) {
  for (std::size_t at = 0; at < codes.size(); at += 3 * kAtOnce) {
    std::array<std::uint16_t, 3 * kAtOnce> some{};
    const std::size_t count = std::min(some.size(), codes.size() - at);
    std::copy_n(codes.data() + at, count, some.data());
    std::array<std::int32_t, 3 * kAtOnce> step;
#pragma omp simd
    for (std::size_t k = 0; k < some.size(); ++k) {
      const double quotient =
          (some[k] * scaling.span[k] + (scaling.half[k] + 0.5)) / scaling.max_code[k];
      step[k] =
          static_cast<std::int32_t>(scaling.min[k] + ((quotient - 0.5 + kRounder) - kRounder));
    }
    std::copy_n(step.data(), count, steps + at);
  }
}

}  // namespace

/// Axes that are exact are scaled by 1.
void PositionQuantizer::decode_scaled(std::span<const std::uint16_t> codes,
                                      std::span<GridPoint> points) const {
  Scaling scaling;
  for (std::size_t k = 0; k < 3 * kAtOnce; ++k) {
    const Axis& axis = axes_[k % 3];
    scaling.min[k] = box_.min[k % 3];
    scaling.span[k] = axis.exact ? 1 : axis.span;
    scaling.half[k] = axis.exact ? 0 : axis.max_code / 2;
    scaling.max_code[k] = axis.exact ? 1 : axis.max_code;
  }
  if (!points.empty()) vectorized<scale_codes>(scaling, codes, points.front().data());
}

template <typename Code>
void PositionQuantizer::decode_all(std::span<const Code> codes, std::span<GridPoint> points) const {
  CAIRN_CHECK(codes.size() == points.size() * 3);
  const std::array<Axis, 3> axes = axes_;  // a copy that the stores below cannot alias
  const Code* in = codes.data();
  if (exact()) {
    for (GridPoint& p : points)
      for (std::size_t a = 0; a < 3; ++a) p[a] = static_cast<std::int32_t>(axes[a].min + *in++);
    return;
  }
  if constexpr (sizeof(Code) == sizeof(std::uint16_t)) return decode_scaled(codes, points);
  for (GridPoint& p : points)
    for (std::size_t a = 0; a < 3; ++a) p[a] = decode_code(axes[a], *in++);
}

void PositionQuantizer::encode(std::span<const GridPoint> points,
                               std::span<std::uint16_t> codes) const {
  encode_all(points, codes);
}
void PositionQuantizer::encode(std::span<const GridPoint> points,
                               std::span<std::uint32_t> codes) const {
  encode_all(points, codes);
}
std::optional<std::size_t> PositionQuantizer::first_beyond(
    std::span<const std::uint16_t> codes) const {
  return find_beyond(codes);
}
std::optional<std::size_t> PositionQuantizer::first_beyond(
    std::span<const std::uint32_t> codes) const {
  return find_beyond(codes);
}
void PositionQuantizer::decode(std::span<const std::uint16_t> codes,
                               std::span<GridPoint> points) const {
  decode_all(codes, points);
}
void PositionQuantizer::decode(std::span<const std::uint32_t> codes,
                               std::span<GridPoint> points) const {
  decode_all(codes, points);
}

RadiusQuantizer::RadiusQuantizer(float min, float max) {
  CAIRN_CHECK(std::isfinite(min) && std::isfinite(max) && min <= max);
  const double low = min;
  const double range = static_cast<double>(max) - low;  // cannot overflow a double
  for (std::size_t code = 0; code < 256; ++code) {
    // Every operation is monotone, so the table is; the last entry is set below, the others are kept
    // from rounding past it.
    const double value = low + range * static_cast<double>(code) / 255.0;
    table_[code] = std::min(static_cast<float>(value), max);
  }
  table_[255] = max;
  codes_per_unit_ = range > 0 ? 255.0 / range : 0;
}

std::uint8_t RadiusQuantizer::encode(float radius) const {
  if (!(radius <= table_[255])) return 255;
  if (radius <= table_[0]) return 0;
  const double estimate =
      (static_cast<double>(radius) - static_cast<double>(table_[0])) * codes_per_unit_;
  // The estimate only says where to start: the table itself decides.
  auto code = static_cast<std::size_t>(std::min(estimate, 255.0));
  while (table_[code] < radius) ++code;
  while (code > 0 && table_[code - 1] >= radius) --code;
  return static_cast<std::uint8_t>(code);
}

void RadiusQuantizer::encode(std::span<const float> radii, std::span<std::uint8_t> codes) const {
  CAIRN_CHECK(codes.size() == radii.size());
  // Neighbours often have one radius.
  for (std::size_t i = 0; i < radii.size(); ++i)
    codes[i] = i > 0 && radii[i] == radii[i - 1] ? codes[i - 1] : encode(radii[i]);
}

void RadiusQuantizer::decode(std::span<const std::uint8_t> codes, std::span<float> radii) const {
  CAIRN_CHECK(codes.size() == radii.size());
  for (std::size_t i = 0; i < radii.size(); ++i) radii[i] = table_[codes[i]];
}

float RadiusQuantizer::max_error() const {
  float largest = 0;
  for (std::size_t code = 1; code < 256; ++code)
    largest = std::max(largest, table_[code] - table_[code - 1]);
  // The subtraction may have rounded down.
  return largest > 0 ? std::nextafter(largest, std::numeric_limits<float>::max()) : 0;
}

}  // namespace cairn::formats
