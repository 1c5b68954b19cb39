#include "formats/scans/e57/spherical.h"

#include <cmath>
#include <numbers>

namespace cairn::formats {
namespace {

// Half of pi in three parts. The first two have 30 bits: a whole number of up to 2^22 times them is exact.
constexpr double kFirst = 0x1.921fb54p+0, kSecond = 0x1.10b46118p-30;
constexpr double kThird = 0x1.313198a2e037p-61;
// Angles up to here are reduced without loss; others are no directions, but must have some.
constexpr double kMostReduced = 1e6;
// Added to a number below 2^51 it rounds it to a whole one.
constexpr double kRounding = 0x1.8p52;

/// Taylor series about 0, up to the term of `power`, of sine (odd powers) or cosine (even ones). At a quarter of pi
/// what they leave out is below a unit of the last place.
template <int Power>
double series(double squared) {
  double sum = 1;
  for (int n = Power; n > 1; n -= 2) sum = 1 - sum * squared / (n * (n - 1));
  return sum;
}

}  // namespace

SineCosine sine_cosine(double angle) {
  if (!(std::fabs(angle) <= kMostReduced)) angle = std::remainder(angle, 2 * std::numbers::pi);
  const double quarters = (angle * (2 / std::numbers::pi) + kRounding) - kRounding;
  const double rest = ((angle - quarters * kFirst) - quarters * kSecond) - quarters * kThird;
  const double squared = rest * rest;
  const double sine = rest * series<15>(squared), cosine = series<16>(squared);
  if (!std::isfinite(quarters)) return {quarters, quarters};
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

Vector3 from_spherical(double range, double azimuth, double elevation) {
  const SineCosine across = sine_cosine(azimuth), up = sine_cosine(elevation);
  const double level = range * up.cosine;
  return {level * across.cosine, level * across.sine, range * up.sine};
}

}  // namespace cairn::formats
