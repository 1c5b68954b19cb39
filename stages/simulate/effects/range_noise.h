// Noise of the measured range, which grows with the distance and with the angle of incidence.
//   R' = R + sigma z,  sigma = sqrt(base^2 + (per_length R)^2) / max(cos(alpha), 0.1),  z normal
// Based on: Sylvie Soudarissanane et al., "Scanning geometry: influencing factor on the quality of terrestrial laser
// points", ISPRS Journal of Photogrammetry and Remote Sensing 66(4), 2011: noise grows as the signal falls with
// range and incidence. Here the two parts of the range are those of data sheets, and the cosine has a floor, since a
// grazing beam gives no echo rather than one without bounds.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct RangeNoise {
  double base = 0;        ///< standard deviation at the scanner, at least 0
  double per_length = 0;  ///< growth with the distance, at least 0

  double sigma(double distance, double incidence_cosine) const;
};

EchoEffectPtr make_range_noise(const RangeNoise& settings, const Draws& draws);

}  // namespace cairn::stages
