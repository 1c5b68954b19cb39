// Arithmetic of vectors in space, for the ray caster.
#pragma once

#include <cmath>

#include "formats/scans/pose.h"

namespace cairn::stages {

using formats::Vector3;

inline Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vector3 operator*(const Vector3& a, double factor) {
  return {a[0] * factor, a[1] * factor, a[2] * factor};
}
inline double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vector3& a) { return std::sqrt(dot(a, a)); }
/// Unit vector along `a`; up if `a` vanishes.
inline Vector3 normalised(const Vector3& a) {
  const double size = length(a);
  return size > 0 ? a * (1 / size) : Vector3{0, 0, 1};
}

}  // namespace cairn::stages
