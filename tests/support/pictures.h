// How far pictures are apart, for tests of what draws them.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "viewer/picture.h"

namespace cairn::test {

/// The share of pixels that differ in a channel by more than 8 levels of 255, which rounding in another order does not bring
/// about; 1 for pictures of two sizes.
inline double share_of_pixels_apart(const viewer::Picture& a, const viewer::Picture& b) {
  if (a.size != b.size) return 1;
  std::size_t apart = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int most = 0;
    for (std::size_t c = i; c < i + 3; ++c) most = std::max(most, std::abs(a.rgb[c] - b.rgb[c]));
    apart += most > 8 ? 1 : 0;
  }
  return 3 * static_cast<double>(apart) / static_cast<double>(a.rgb.size());
}

}  // namespace cairn::test
