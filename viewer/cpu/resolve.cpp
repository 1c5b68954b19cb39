#include "viewer/cpu/resolve.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "formats/error.h"
#include "viewer/cpu/nearest_buffer.h"
#include "viewer/cpu/rounding.h"
#include "viewer/renderer.h"

namespace cairn::viewer {
namespace {

/// Rows that are worked on at a time.
constexpr std::size_t kBandRows = 32;
/// How far eye-dome lighting looks.
constexpr std::size_t kReach = shading::kEyeDomePixels;
/// Nothing is nearer than the background.
constexpr float kFarthest = std::numeric_limits<float>::infinity();

float log_depth(std::uint64_t word) {
  if (word == kNoFragment) return kFarthest;
  return std::log2(std::bit_cast<float>(static_cast<std::uint32_t>(word >> 32)));
}

/// Logarithms of the depths of some rows with a rim of kReach on each side; beside the picture as the background.
class LogDepths {
 public:
  LogDepths(std::span<const std::uint64_t> words, PictureSize size, std::size_t first_row,
            std::size_t rows)
      : stride_(size.width + 2 * kReach), logs_((rows + 2 * kReach) * stride_, kFarthest) {
    for (std::size_t i = 0; i < rows + 2 * kReach; ++i) {
      if (first_row + i < kReach || first_row + i - kReach >= size.height) continue;
      const auto row = words.subspan((first_row + i - kReach) * size.width, size.width);
      std::transform(row.begin(), row.end(), &logs_[i * stride_ + kReach], log_depth);
    }
  }

  /// The factor of a pixel's color; row counts from the first.
  float factor(std::size_t row, std::size_t column) const {
    constexpr std::ptrdiff_t kStep = kReach;
    const auto stride = static_cast<std::ptrdiff_t>(stride_);
    const float* here = &logs_[(row + kReach) * stride_ + column + kReach];
    float sum = 0;
    for (const std::ptrdiff_t to :
         {-kStep * stride - kStep, -kStep * stride, -kStep * stride + kStep, -kStep, kStep,
          kStep * stride - kStep, kStep * stride, kStep * stride + kStep})
      sum += std::max(0.0f, *here - here[to]);
    return sum == 0 ? 1 : std::exp(-shading::kEyeDomeStrength * (sum / 8));
  }

 private:
  std::size_t stride_;
  std::vector<float> logs_;
};

void put(std::uint64_t word, float factor, std::uint8_t* rgb) {
  for (int channel = 0; channel < 3; ++channel) {
    const auto byte = static_cast<float>(word >> (8 * channel) & 0xff);
    rgb[channel] = static_cast<std::uint8_t>(rounded(byte * factor));
  }
}

void resolve_rows(std::span<const std::uint64_t> words, bool eye_dome, PictureSize size,
                  std::size_t first_row, std::size_t rows, std::uint8_t* rgb) {
  const LogDepths depths(words, size, first_row, eye_dome ? rows : 0);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < size.width; ++column, rgb += 3) {
      const std::uint64_t word = words[(first_row + row) * size.width + column];
      if (word == kNoFragment)
        std::copy(std::begin(shading::kBackground), std::end(shading::kBackground), rgb);
      else
        put(word, eye_dome ? depths.factor(row, column) : 1.0f, rgb);
    }
}

}  // namespace

void resolve(std::span<const std::uint64_t> words, bool eye_dome, Picture& picture) {
  const PictureSize size = picture.size;
  CAIRN_CHECK(words.size() == std::size_t{size.width} * size.height);
  picture.rgb.resize(3 * words.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size.height, kBandRows),
                    [&](const tbb::blocked_range<std::size_t>& rows) {
                      resolve_rows(words, eye_dome, size, rows.begin(), rows.size(),
                                   &picture.rgb[3 * rows.begin() * size.width]);
                    });
}

}  // namespace cairn::viewer
