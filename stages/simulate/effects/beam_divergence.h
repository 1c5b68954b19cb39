// The beam is a cone: a footprint that covers an edge, or a slanting surface, gives a range in between (mixed pixels).
//   R' = R + sum(P_k R_k) / sum(P_k) - R_0,  P_k = rho_k cos(alpha_k) / R_k^2
// over those of `rays` sub-rays whose surfaces are no farther than `resolution` from that of the axis, along the range:
// the receiver tells echoes apart that lie farther from each other. Ray 0 is the axis; where it meets nothing, the first
// that does takes its place. Sub-ray k of n lies at the angle (divergence / 2) sqrt(-ln(1 - (k + 1/2) / n) / 2) from the
// axis, the quantiles of a Gaussian beam, so that all have the same energy, and at k golden angles around it. Leaves, which
// are points, do not mix; sub-rays pass through foliage as beams do.
// Based on: Martial Hebert and Eric Krotkov, "3D measurements from imaging laser radars: how good are they?", Image and
// Vision Computing 10(3), 1992, for mixed pixels. The beam begins as a point; what is mixed is the range alone.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct BeamDivergence {
  double divergence =
      0.02;               ///< full angle where the intensity has fallen to 1/e^2, degrees; 0 to 10
  double resolution = 1;  ///< above 0
  unsigned rays = 7;      ///< 2 to 1000
};

/// Draws no random number.
EchoEffectPtr make_beam_divergence(const BeamDivergence& settings);

}  // namespace cairn::stages
