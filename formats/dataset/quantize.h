// Positions and radii of a node as small integers, and back.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point
// Models Using Multi-way kd-Trees", 2010, section III.C: positions relative to the node's box with 16
// bits a coordinate, radii with 8 bits between the node's extremes. Where it departs: any width of 1
// to 32 bits, exact wherever the box spans few enough grid steps; radii are rounded up, so that a
// decoded splat never covers less than the original.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/dataset/grid.h"
#include "formats/schema.h"

namespace cairn::formats {

/// Maps the grid steps of a box to codes of `bits` bits a coordinate. With D = box.span(axis) and
/// M = 2^bits - 1, an axis with D <= M is exact: code = x - min. Any other axis takes the nearest of
/// M + 1 levels that divide [min, max] evenly, code = round(d * M / D) and d' = round(code * D / M), both
/// rounded half up in exact integer arithmetic. Both ends of the box decode to themselves, the mapping
/// is monotone, and decoded positions never leave the box.
class PositionQuantizer {
 public:
  /// Requires a box that is not empty on any axis and 1 <= bits <= 32 (an Error of kind kInvariant
  /// otherwise: a reader must have checked both where they were read).
  PositionQuantizer(const GridBox& box, unsigned bits);

  const GridBox& box() const { return box_; }
  unsigned bits() const { return bits_; }
  /// The type of the position section, three components: kU16 up to 16 bits, kU32 above.
  ScalarType code_type() const { return bits_ <= 16 ? ScalarType::kU16 : ScalarType::kU32; }

  bool exact(int axis) const { return axes_[static_cast<std::size_t>(axis)].exact; }
  bool exact() const { return exact(0) && exact(1) && exact(2); }
  /// No decoded coordinate of a point of the box is farther from the original: 0 if exact, else
  /// floor(D / 2M + 1/2), the half level of encoding and the half step of decoding.
  std::uint32_t max_error_steps(int axis) const;

  /// Codes of points inside the box, x, y, z interleaved: codes.size() == 3 * points.size(). The 16-bit
  /// forms require bits() <= 16. Coordinates outside the box are taken to its nearest end.
  void encode(std::span<const GridPoint> points, std::span<std::uint16_t> codes) const;
  void encode(std::span<const GridPoint> points, std::span<std::uint32_t> codes) const;

  /// The largest code of an axis: D if it is exact, else M.
  std::uint32_t max_code(int axis) const { return axes_[static_cast<std::size_t>(axis)].max_code; }
  /// The index of a code above the largest of its axis, the first one; met in damaged data only.
  std::optional<std::size_t> first_beyond(std::span<const std::uint16_t> codes) const;
  std::optional<std::size_t> first_beyond(std::span<const std::uint32_t> codes) const;

  /// The reverse; points.size() * 3 == codes.size(). Requires codes none of which is beyond the largest.
  void decode(std::span<const std::uint16_t> codes, std::span<GridPoint> points) const;
  void decode(std::span<const std::uint32_t> codes, std::span<GridPoint> points) const;

 private:
  struct Axis {
    std::uint32_t min = 0;       ///< box_.min as two's complement bits
    std::uint32_t span = 0;      ///< D
    std::uint32_t max_code = 0;  ///< D if exact, else M
    bool exact = true;
    std::uint64_t span_reciprocal = 0;  ///< floor((2^64 - 1) / D), of inexact axes
    std::uint64_t code_reciprocal = 0;  ///< floor((2^64 - 1) / M), of inexact axes
  };

  static std::uint32_t encode_step(const Axis& axis, std::int32_t min, std::int32_t step);
  static std::int32_t decode_code(const Axis& axis, std::uint32_t code);
  template <typename Code>
  void encode_all(std::span<const GridPoint> points, std::span<Code> codes) const;
  template <typename Code>
  std::optional<std::size_t> find_beyond(std::span<const Code> codes) const;
  void decode_scaled(std::span<const std::uint16_t> codes, std::span<GridPoint> points) const;
  template <typename Code>
  void decode_all(std::span<const Code> codes, std::span<GridPoint> points) const;

  GridBox box_;
  unsigned bits_;
  std::array<Axis, 3> axes_;
};

/// Radii as 8 bits between a node's extremes, by a table of the 256 values that codes decode to: the
/// first is the smallest radius, the last the largest, exactly.
class RadiusQuantizer {
 public:
  /// Requires finite min <= max (an Error of kind kInvariant otherwise).
  RadiusQuantizer(float min, float max);

  /// The smallest code that decodes to at least `radius`; the largest code for a radius above the
  /// maximum and for NaN. So decode(encode(r)) >= r for every r <= max, and decode(encode(r)) - r is
  /// below max_error() for every r between the extremes. Equal extremes always give code 0.
  std::uint8_t encode(float radius) const;
  float decode(std::uint8_t code) const { return table_[code]; }

  /// Sizes equal.
  void encode(std::span<const float> radii, std::span<std::uint8_t> codes) const;
  void decode(std::span<const std::uint8_t> codes, std::span<float> radii) const;

  /// The largest difference between the values of neighbouring codes.
  float max_error() const;

 private:
  std::array<float, 256> table_;
  double codes_per_unit_ = 0;
};

}  // namespace cairn::formats
