// What a reduced picture loses against the full one of the same view.
// Based on: Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
// Similarity", IEEE Transactions on Image Processing 13(4), 2004, section III, for SSIM.
// Luminance Y is 0.299 R + 0.587 G + 0.114 B (Rec. ITU-R BT.601), in levels from 0 to 255, not rounded.
#pragma once

#include <cstdint>
#include <vector>

#include "viewer/picture.h"

namespace cairn::viewer {

/// A picture, and which of its pixels show a point, not the background.
struct CoveredPicture {
  Picture picture;
  std::vector<std::uint8_t> covered;  ///< 1 or 0 a pixel, rows from the top
};

struct PictureDifference {
  double mse =
      0;  ///< mean of the squared differences of all channels of all pixels, levels squared
  /// Mean of SSIM over all windows that lie in the picture: 11 x 11 pixels of luminance under a Gaussian of sigma
  /// 1.5, K1 = 0.01, K2 = 0.03, L = 255; 1 for equal pictures, NaN if the picture has no room for a window.
  double ssim = 1;
  double differ = 0;  ///< share of pixels that differ by more than kDifferentLevels in a channel
  double holes = 0;   ///< share of pixels that the full picture draws and the other leaves empty
  double extra = 0;   ///< share of pixels that the other draws and the full picture leaves empty
  /// What differs from pixel to pixel, holes aside, in levels: with d = Y(other) - Y(full) at the pixels that both
  /// draw, and m of them in the 5 x 5 pixels around one, sqrt(sum (d - mean of the m)^2 / sum (1 - 1/m)). Brightness
  /// that is off over an area adds nothing; differences that are independent between pixels give their standard
  /// deviation. What is grainy in the full picture and smooth in the other counts as the reverse does, and patches
  /// much larger than 5 pixels count at their edges alone.
  double noise = 0;

  /// 10 log10(255^2 / mse), decibels; infinite for equal pictures.
  double psnr() const;
};

inline constexpr int kDifferentLevels = 8;

/// The same bits for any number of threads. Requires pictures of one size, with coverages.
PictureDifference difference_of(const CoveredPicture& full, const CoveredPicture& other);

/// Means of each measure; that of the squared differences keeps PSNR defined where a picture is equal. Requires some.
PictureDifference mean_of(const std::vector<PictureDifference>& differences);

/// The differences of all channels, times `factor`, up to 255. Requires pictures of one size.
Picture amplified_difference(const Picture& a, const Picture& b, int factor);

}  // namespace cairn::viewer
