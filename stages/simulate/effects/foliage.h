// Foliage: beams pass through objects that are marked with a leaf area density, and meet leaves inside, several a beam.
//   way to the next leaf = -ln(u) / (G density),  G = 1/2,  u uniform
// so that a way s through leaves is free with the probability exp(-G density s): Beer and Lambert for canopies, with G
// the mean projection of leaves that look in all directions alike. A leaf takes the share `blocked` of the light that
// arrives; what is left goes on, to a solid object or out of the range, for at most `returns` echoes.
// Based on: Tiit Nilson, "A theoretical analysis of the frequency of gaps in plant stands", Agricultural Meteorology 8,
// 1971. Here leaves are points that face the scanner. Marked objects are convex, may overlap, touch each other and solid
// objects, and hold a station. Where several overlap their densities add up.
#pragma once

#include "stages/simulate/effects/effect.h"

namespace cairn::stages {

struct Foliage {
  std::uint32_t returns = 5;  ///< 1 to 15
  double blocked = 0.5;       ///< above 0, at most 1
};

EchoEffectPtr make_foliage(const Foliage& settings, const Draws& draws);

}  // namespace cairn::stages
