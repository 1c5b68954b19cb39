#include "stages/simulate/effects/moving_objects.h"

#include <cmath>

namespace cairn::stages {

Vector3 displacement(const SceneObject& object, double time) {
  const double rounds = time / object.walk_time;
  return object.walk * (1 - std::fabs(1 - 2 * (rounds - std::floor(rounds))));
}

}  // namespace cairn::stages
