// Intensity as the receiver sees it: darker for dark, slanting and distant surfaces, in air that absorbs.
//   I' = min(1, rho cos(alpha) (reference_range / R)^2 exp(-2 attenuation (R - reference_range)))
// Source: as of returned_power in light.h, with the attenuation of the air on the way there and back (Beer and
// Lambert), relative to that at the reference range.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct IntensityFalloff {
  double reference_range =
      10;  ///< where a white surface that faces the scanner has intensity 1; above 0
  double attenuation = 0;  ///< a unit of length, at least 0
};

/// Draws no random number.
EchoEffectPtr make_intensity_falloff(const IntensityFalloff& settings);

}  // namespace cairn::stages
