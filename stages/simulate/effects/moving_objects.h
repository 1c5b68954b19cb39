// Objects that move while they are scanned, and leave sheared, broken and repeated ghosts.
//   position(t) = position + walk tri(t / walk_time),  t = scan_time (station + ray / rays)
// with tri(x) = 1 - |1 - 2 (x - floor(x))|: there and back again, at constant speed. Stations are scanned one after the
// other without a pause, each in `scan_time`, column by column as the head turns.
// Based on: Dirk Hähnel, Dirk Schulz and Wolfram Burgard, "Map building with mobile robots in populated
// environments", IROS 2002, which tells what such objects do to maps; the motion is our own, one that stays in a scene.
#pragma once

#include "stages/simulate/scene.h"

namespace cairn::stages {

struct MovingObjects {
  double scan_time = 100;  ///< of a station; above 0
};

/// How far an object is from its position at a time.
Vector3 displacement(const SceneObject& object, double time);

}  // namespace cairn::stages
