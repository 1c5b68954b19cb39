// False alarms: echoes that noise of the receiver makes up, anywhere within the range, also where nothing is.
//   with probability `share`: R' = max_range u,  u uniform
// Based on: Donald G. Fouche, "Detection and false-alarm probabilities for laser radars that use Geiger-mode detectors",
// Applied Optics 42(27), 2003: noise counts arrive at a constant rate during the range gate. For the small rates that
// count here their times are uniform; at most one is told, and it takes the place of the ray's own echoes.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct Outliers {
  double share = 0.001;  ///< of the rays; 0 to 1
};

EchoEffectPtr make_outliers(const Outliers& settings, const Draws& draws);

}  // namespace cairn::stages
