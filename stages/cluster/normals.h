// What reducers ask of normals: whether there is one, and whether two of them agree.
#pragma once

#include "formats/dataset/normal_map.h"

namespace cairn::stages {

/// Sums of normals shorter than this share of their weight tell no direction.
inline constexpr double kCancelled = 1e-3;

inline bool is_direction(const formats::Normal& n) { return n[0] != 0 || n[1] != 0 || n[2] != 0; }

/// The cosine between unit normals; 1 where one is missing: it agrees with every other.
inline float agreement(const formats::Normal& a, const formats::Normal& b) {
  return is_direction(a) && is_direction(b) ? a[0] * b[0] + a[1] * b[1] + a[2] * b[2] : 1.0F;
}

/// The least cosine between normals that deviate by no more than this (0 to 180), with room for rounding: a normal agrees
/// with itself, and with any where all are allowed.
float cosine_of_limit(float theta_degrees);

}  // namespace cairn::stages
