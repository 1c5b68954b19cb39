// Angles in degrees.
#pragma once

#include <cmath>
#include <numbers>

namespace cairn::stages {

struct SineCosine {
  double sine, cosine;
};

/// Exact at multiples of 90 degrees, so that scenes with right angles stay free of last digits.
inline SineCosine sine_cosine(double degrees) {
  const double quarters = std::nearbyint(degrees / 90);
  const double rest = (degrees - 90 * quarters) * (std::numbers::pi / 180);
  const double s = std::sin(rest), c = std::cos(rest);
  switch (static_cast<int>(quarters - 4 * std::floor(quarters / 4))) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

}  // namespace cairn::stages
