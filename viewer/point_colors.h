// Colors of points from what a dataset has of them, as PointColumns::color.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/schema.h"

namespace cairn::viewer {

/// Red, green and blue, 0 to 255, packed.
std::uint32_t pack_color(std::uint32_t red, std::uint32_t green, std::uint32_t blue);

/// The perceptually uniform ramp viridis (van der Walt, Smith 2015), from 0, dark blue, to 1, yellow.
std::uint32_t ramp_color(double share);
/// A color for each of a list of things, such as levels; neighbors differ clearly.
std::uint32_t palette_color(std::uint32_t index);
/// Colors for the classes of the LAS specification 1.4 (table 17): ground brown, vegetation green, ...
std::uint32_t class_color(std::uint32_t classification);

/// The values between which a ramp runs.
struct ValueRange {
  double least = 0;
  double greatest = 1;
};
/// Between the 1st and the 99th percentile, so that one bright reflector does not darken all else. {0, 1} of no values.
ValueRange middle_range(std::vector<double> values);

/// Scalars of a column of an attribute, its first component, as doubles.
std::vector<double> column_values(std::span<const std::byte> column,
                                  const formats::Attribute& attribute);
/// Bits of the brightest component of a column of integers: 8 if all fit into them, as where 8-bit colors stand in 16-bit
/// fields, else 16.
unsigned color_bits(std::span<const std::byte> column, const formats::Attribute& attribute);
/// Colors of a column of three integers of so many bits (8 or 16) a point. 16-bit ones lose their lower byte; what is
/// brighter than the bits tell is drawn as bright as can be.
void convert_colors(std::span<const std::byte> column, const formats::Attribute& attribute,
                    unsigned bits, std::vector<std::uint32_t>& colors);

}  // namespace cairn::viewer
