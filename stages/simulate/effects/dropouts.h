// Rays whose echo is too weak to be seen: the distant, the slanting and the dark ones.
//   P(no echo) = exp(-n),  n = photons rho cos(alpha) (reference_range / R)^2
// Based on: John J. Degnan, "Photon-counting multikilohertz microlaser altimeters for airborne and spaceborne
// topographic measurements", Journal of Geodynamics 34(3-4), 2002: photons arrive as Poisson says, and one is enough.
// The mean n follows the laser radar equation in light.h.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct Dropouts {
  /// Mean of those detected from a white surface that faces the scanner at the reference range; at least 0.
  double photons = 100;
  double reference_range = 10;  ///< above 0
};

EchoEffectPtr make_dropouts(const Dropouts& settings, const Draws& draws);

}  // namespace cairn::stages
