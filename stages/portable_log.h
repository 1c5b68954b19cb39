// Logarithm and exponential from the four operations alone: the C library's differ in their last bits between
// machines, and what a build decides by them must not.
#pragma once

#include <cmath>
#include <numbers>

namespace cairn::stages {

/// ln x, to about 1e-15; for finite x > 0. By the series of the inverse hyperbolic tangent.
inline double portable_log(double x) {
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < std::numbers::sqrt2 / 2) {
    mantissa *= 2;
    --exponent;
  }
  const double t = (mantissa - 1) / (mantissa + 1);
  double sum = 0;
  for (int k = 27; k >= 1; k -= 2) sum = sum * t * t + 1.0 / k;
  return exponent * std::numbers::ln2 + 2 * t * sum;
}

/// e^x, to a relative 1e-15; for |x| < 700. By the exponential series.
inline double portable_exp(double x) {
  const double whole = std::floor(x / std::numbers::ln2 + 0.5);
  const double rest = x - whole * std::numbers::ln2;
  double sum = 1;
  for (int k = 20; k >= 1; --k) sum = 1 + sum * rest / k;
  return std::ldexp(sum, static_cast<int>(whole));
}

}  // namespace cairn::stages
