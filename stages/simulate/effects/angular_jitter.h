// Noise of the angles that the scanner's encoders read: the beam is where the raster says, the point is told a little
// beside it.
//   azimuth' = azimuth + sigma_a z1,  elevation' = elevation + sigma_e z2,  z1 and z2 normal
// Based on: Derek D. Lichti, "Error modelling, calibration and analysis of an AM-CW terrestrial laser scanner system",
// ISPRS Journal of Photogrammetry and Remote Sensing 61(5), 2007: horizontal direction and elevation angle as
// observations with random errors of their own. Its systematic errors are left out.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct AngularJitter {
  double azimuth = 0, elevation = 0;  ///< standard deviations in degrees, at least 0
};

EchoEffectPtr make_angular_jitter(const AngularJitter& settings, const Draws& draws);

}  // namespace cairn::stages
