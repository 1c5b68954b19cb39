#include "viewer/point_columns.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace cairn::viewer {
namespace {

constexpr float kUnit = 511;
constexpr std::uint32_t kMask = 0x3ff;

std::uint32_t pack(float value) {
  const float steps = std::nearbyint(std::clamp(value, -1.0f, 1.0f) * kUnit);
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(steps)) & kMask;
}

float unpack(std::uint32_t bits) {
  const auto value = static_cast<std::int32_t>((bits & kMask) << 22) >> 22;
  return static_cast<float>(value) / kUnit;
}

}  // namespace

std::uint32_t pack_normal(const glm::vec3& unit) {
  return pack(unit.x) | pack(unit.y) << 10 | pack(unit.z) << 20;
}

glm::vec3 unpack_normal(std::uint32_t packed) {
  const glm::vec3 normal(unpack(packed), unpack(packed >> 10), unpack(packed >> 20));
  return packed == 0 ? normal : glm::normalize(normal);
}

}  // namespace cairn::viewer
