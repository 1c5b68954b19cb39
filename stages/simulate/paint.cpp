#include <algorithm>
#include <cmath>

#include "stages/simulate/scene.h"

namespace cairn::stages {
namespace {

Rgb checker(const Paint& paint, const Vector3& point, const Vector3& normal) {
  // Seen a little below the surface, so that faces between two layers of cubes have one colour.
  constexpr double kDepth = 1e-3;
  bool odd = false;
  for (std::size_t axis = 0; axis < 3; ++axis)
    odd ^= std::fmod(std::floor(point[axis] / paint.cube_size - kDepth * normal[axis]), 2) != 0;
  return odd ? paint.second : paint.first;
}

Rgb gradient(const Paint& paint, const Box& extent, const Vector3& point) {
  const double height = extent.max[2] - extent.min[2];
  const double share = height > 0 ? std::clamp((point[2] - extent.min[2]) / height, 0.0, 1.0) : 0.0;
  Rgb color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = static_cast<std::uint8_t>(
        std::lround(paint.first[i] + share * (paint.second[i] - paint.first[i])));
  return color;
}

}  // namespace

Rgb color_at(const Paint& paint, const Box& extent, const Vector3& point, const Vector3& normal) {
  switch (paint.pattern) {
    case Pattern::kPlain:
      break;
    case Pattern::kChecker:
      return checker(paint, point, normal);
    case Pattern::kGradient:
      return gradient(paint, extent, point);
  }
  return paint.first;
}

}  // namespace cairn::stages
