#include "formats/tiles/linear_color.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace cairn::formats {
namespace {

constexpr double kLargest = 65535;
/// How far, in steps of 8 bits, an 8-bit value may be moved: by half a step it would be shown as another.
constexpr double kTolerance = 0.45;
/// How far at most, in steps of 8 bits, a value is darkened for clients that take a power for sRGB.
constexpr double kMostDarkening = 2.5;
constexpr double kGamma = 2.2;

/// Of an sRGB value from 0 to 1.
double linear_of(double share) {
  return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

/// What to store in place of an sRGB value; both from 0 to 255.
double darkened(double value) {
  const double by_power = 255 * std::pow(linear_of(value / 255), 1 / kGamma);
  return value - std::clamp((by_power - value) / 2, 0.0, kMostDarkening);
}

/// Of an sRGB value from 0 to 255, 0 to 65535.
double stored(double value) { return kLargest * linear_of(std::clamp(value, 0.0, 255.0) / 255); }

/// The multiple of the largest power of two that is near enough to the value.
std::uint16_t round_value(double value) {
  const double least = stored(value - kTolerance), greatest = stored(value + kTolerance);
  for (double step = 256; step > 1; step /= 2) {
    const double multiple = std::round(stored(value) / step) * step;
    if (multiple >= least && multiple <= greatest) return static_cast<std::uint16_t>(multiple);
  }
  return static_cast<std::uint16_t>(std::lround(stored(value)));
}

std::vector<std::uint16_t> narrow_table() {
  std::vector<std::uint16_t> table(256);
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] = round_value(darkened(static_cast<double>(i)));
  table.back() = UINT16_MAX;  // white is white
  return table;
}

std::vector<std::uint16_t> wide_table() {
  std::vector<std::uint16_t> table(65536);
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] =
        static_cast<std::uint16_t>(std::lround(stored(darkened(static_cast<double>(i) / 257))));
  return table;
}

}  // namespace

std::uint16_t linear_of_srgb(std::uint16_t value, unsigned bits) {
  static const std::vector<std::uint16_t> narrow = narrow_table(), wide = wide_table();
  return bits == 8 ? narrow[std::min<std::size_t>(value, narrow.size() - 1)] : wide[value];
}

}  // namespace cairn::formats
