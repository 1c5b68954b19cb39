// Exposure and white balance of the camera, which differ from station to station:
//   c' = encoded(linear(c) 2^(e + b_c)),  e = exposure z0,  b_c = white_balance z_c a channel,  z normal
// Exposure scales light, so it acts on linear light (sRGB, IEC 61966-2-1), and a bright channel is clipped; white
// balance is a gain a channel, the diagonal model of Johannes von Kries. The case of overlapping scans of different
// exposure is that of Markus Schütz et al., "GPU-accelerated LOD generation for point clouds", Computer Graphics
// Forum 42(8), 2023, section 6.2.
#pragma once

#include <array>

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

/// Standard deviations in stops, powers of two; at least 0.
struct Exposure {
  double exposure = 0;
  double white_balance = 0;

  /// The factors of the three channels at the station of `draws`.
  std::array<double, 3> gains(const Draws& draws) const;
};

EchoEffectPtr make_exposure(const Exposure& settings, const Draws& draws);

}  // namespace cairn::stages
