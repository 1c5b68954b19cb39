// Errors of registration: the rays start where the station stands, but its pose is told a little wrong.
//   t' = t + translation (z1, z2, z3),  q' = q turn(rotation (z4, z5, z6)),  z normal
// with the turns yaw, pitch and roll about the station's own axes: the six parameters of a rigid motion.
// Based on: Paul J. Besl and Neil D. McKay, "A method for registration of 3-D shapes", IEEE Transactions on Pattern
// Analysis and Machine Intelligence 14(2), 1992, for the parameters; here their errors are independent.
#pragma once

#include "stages/simulate/effects/random.h"
#include "stages/simulate/scene.h"

namespace cairn::stages {

struct RegistrationError {
  double translation = 0;  ///< standard deviation along each axis of the world, at least 0
  double rotation = 0;     ///< standard deviation of each angle, degrees, at least 0
};

/// The station as the survey believes it to stand.
Station misplaced(Station station, const RegistrationError& error, const Draws& draws);

}  // namespace cairn::stages
