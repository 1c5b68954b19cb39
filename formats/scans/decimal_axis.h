// Coordinates of a grid as the decimal numbers that they are. Steps of 0.01 have no exact double: what
// offset + step * i gives is off by up to half a unit in the last place, and its shortest text may be 637012.3200000001.
// Integers have no such rounding: 637012.32 is what the scanner wrote, and reads back as the double next to it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace cairn::formats {

/// One axis of a grid, offset + step * i.
class DecimalAxis {
 public:
  /// A sign, 19 digits, a point and a zero before it.
  static constexpr std::size_t kMostBytes = 24;

  /// Takes step and offset for the shortest decimals that read back as they are. Nothing where one of these has more
  /// than 12 places, or a coordinate of an int32 step would need more than 18 digits: then the grid is binary, and
  /// doubles tell its coordinates best. Requires finite values and step > 0.
  static std::optional<DecimalAxis> of(double step, double offset);

  /// Writes the coordinate of step i with as many places as the grid has; returns the end. Requires kMostBytes of room.
  char* write(char* to, std::int32_t i) const;

 private:
  DecimalAxis(std::int64_t step, std::int64_t offset, int places)
      : step_(step), offset_(offset), places_(places) {}

  std::int64_t step_;  ///< in units of 10^-places
  std::int64_t offset_;
  int places_;
};

}  // namespace cairn::formats
