// Dust, rain or snow in the air: what a beam meets before the scene sends an echo of its own, instead of the scene's.
//   s = -mean_free_path ln(u),  u uniform; a particle is met where s is less than the scene's distance
// so that a beam of length R meets one with the probability 1 - exp(-R / mean_free_path). Particles lie as Poisson says,
// which makes the way to the first exponential (the extinction of Beer and Lambert).
// Based on: Christopher Goodin et al., "Predicting the influence of rain on LIDAR in ADAS", Electronics 8(1), 2019, for
// the extinction. Here every particle that is met sends an echo, and none weakens the echoes behind it.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct Dust {
  double mean_free_path = 1000;  ///< above 0
  Rgb color{150, 145, 140};
};

EchoEffectPtr make_dust(const Dust& settings, const Draws& draws);

}  // namespace cairn::stages
