#include "formats/tiles/linear_color.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

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

/// What to store in place of an sRGB value for clients of both kinds; both from 0 to 255.
double darkened(double value) {
  const double by_power = 255 * std::pow(linear_of(value / 255), 1 / kGamma);
  return std::max(0.0, value - std::clamp((by_power - value) / 2, 0.0, kMostDarkening));
}

/// Of an sRGB value, which is taken as one from 0 to 255: 0 to 65535.
double stored(double value, ColorClient client) {
  const double inside = std::clamp(value, 0.0, 255.0);
  return kLargest * (client == ColorClient::kCesium ? std::pow(inside / 255, kGamma)
                                                    : linear_of(darkened(inside) / 255));
}

/// The multiple of the largest power of two that is near enough to the value.
std::uint16_t round_value(double value, ColorClient client) {
  const double exact = stored(value, client);
  const double least = stored(value - kTolerance, client),
               greatest = stored(value + kTolerance, client);
  for (double step = 256; step > 1; step /= 2) {
    const double multiple = std::round(exact / step) * step;
    if (multiple >= least && multiple <= greatest) return static_cast<std::uint16_t>(multiple);
  }
  return static_cast<std::uint16_t>(std::lround(exact));
}

}  // namespace

const char* name_of(ColorClient client) {
  return client == ColorClient::kCesium ? "cesiumjs" : "any";
}

std::optional<ColorClient> color_client_named(std::string_view name) {
  for (const ColorClient client : {ColorClient::kAny, ColorClient::kCesium})
    if (name == name_of(client)) return client;
  return std::nullopt;
}

LinearColors::LinearColors(unsigned bits, ColorClient client) : table_(bits == 8 ? 256 : 65536) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    const auto value = static_cast<double>(i);
    table_[i] = bits == 8 ? round_value(value, client)
                          : static_cast<std::uint16_t>(std::lround(stored(value / 257, client)));
  }
  table_.back() = UINT16_MAX;  // white is white
}

}  // namespace cairn::formats
