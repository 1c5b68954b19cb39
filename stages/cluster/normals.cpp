#include "stages/cluster/normals.h"

#include <cmath>
#include <numbers>

namespace cairn::stages {

float cosine_of_limit(float theta_degrees) {
  if (theta_degrees >= 180.0F) return -2.0F;
  return static_cast<float>(
             std::cos(static_cast<double>(theta_degrees) * std::numbers::pi / 180.0)) -
         1e-6F;
}

}  // namespace cairn::stages
