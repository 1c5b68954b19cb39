#include "stages/simulate/effects/light.h"

#include <algorithm>
#include <cmath>

namespace cairn::stages {

double linear_light(std::uint8_t channel) {
  static const auto table = [] {
    std::array<double, 256> light{};
    for (std::size_t i = 0; i < light.size(); ++i) {
      const double value = static_cast<double>(i) / 255;
      light[i] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    }
    return light;
  }();
  return table[channel];
}

std::uint8_t encoded_light(double light) {
  const double value =
      light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

double reflectance(const Rgb& surface) {
  return 0.2126 * linear_light(surface[0]) + 0.7152 * linear_light(surface[1]) +
         0.0722 * linear_light(surface[2]);
}

double returned_power(const Echo& echo, double reference_range) {
  const double nearness = reference_range / echo.distance;
  return echo.energy * reflectance(echo.surface) * echo.incidence_cosine * nearness * nearness;
}

}  // namespace cairn::stages
