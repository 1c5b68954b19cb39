#include "viewer/picture_difference.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

constexpr std::size_t kWindow = 11;
constexpr double kSigma = 1.5;
constexpr double kC1 = (0.01 * 255) * (0.01 * 255);
constexpr double kC2 = (0.03 * 255) * (0.03 * 255);
constexpr std::size_t kNoiseReach = 2;
/// Luminances are integers in these parts of a level, which their weights make exact.
constexpr int kLevelParts = 1000;

using Luminance = std::vector<std::int32_t>;  ///< one a pixel

Luminance luminance_of(const Picture& picture) {
  Luminance luminance(picture.rgb.size() / 3);
  for (std::size_t i = 0; i < luminance.size(); ++i) {
    const std::uint8_t* rgb = &picture.rgb[3 * i];
    luminance[i] = 299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2];
  }
  return luminance;
}

/// row(0), row(1), ..., computed in parallel, so that their sum does not depend on threads.
template <typename Result, typename Row>
std::vector<Result> for_rows(std::size_t rows, const Row& row) {
  std::vector<Result> results(rows);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rows),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t y = range.begin(); y < range.end(); ++y) results[y] = row(y);
                    });
  return results;
}

/// The window's weights along one axis: those of the plane are their products.
std::array<double, kWindow> window_weights() {
  std::array<double, kWindow> weights{};
  for (std::size_t i = 0; i < kWindow; ++i) {
    const double x = (static_cast<double>(i) - kWindow / 2) / kSigma;
    weights[i] = std::exp(-x * x / 2);
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Weighted means of x, y, xx, yy and xy.
using Moments = std::array<double, 5>;

void add(double weight, const Moments& more, Moments& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += weight * more[i];
}

/// Formula (13) of the paper.
double ssim_of(const Moments& window) {
  const auto& [x, y, xx, yy, xy] = window;
  return (2 * x * y + kC1) * (2 * (xy - x * y) + kC2) /
         ((x * x + y * y + kC1) * ((xx - x * x) + (yy - y * y) + kC2));
}

double mean_ssim(const Luminance& a, const Luminance& b, PictureSize size) {
  if (size.width < kWindow || size.height < kWindow)
    return std::numeric_limits<double>::quiet_NaN();
  const auto weights = window_weights();
  const std::size_t rows = size.height - kWindow + 1;
  const std::size_t columns = size.width - kWindow + 1;
  const auto sums = for_rows<double>(rows, [&](std::size_t top) {
    std::vector<Moments> down(size.width, Moments{});
    for (std::size_t i = 0; i < kWindow; ++i)
      for (std::size_t column = 0; column < size.width; ++column) {
        const std::size_t pixel = (top + i) * size.width + column;
        const double x = static_cast<double>(a[pixel]) / kLevelParts;
        const double y = static_cast<double>(b[pixel]) / kLevelParts;
        add(weights[i], {x, y, x * x, y * y, x * y}, down[column]);
      }
    double of_row = 0;
    for (std::size_t left = 0; left < columns; ++left) {
      Moments window{};
      for (std::size_t i = 0; i < kWindow; ++i) add(weights[i], down[left + i], window);
      of_row += ssim_of(window);
    }
    return of_row;
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0) / static_cast<double>(rows * columns);
}

/// Squared deviations of pixels from their neighborhoods, and the share of the variance that each stands for.
struct Deviations {
  double squares = 0;
  double shares = 0;
};

/// Differences of luminance where both pictures draw.
struct CommonDifferences {
  PictureSize size;
  std::vector<std::int32_t> values;  ///< 0 elsewhere
  std::vector<std::uint8_t> common;  ///< 1 where both draw, 0 elsewhere

  void add_deviation(std::size_t row, std::size_t column, Deviations& to) const {
    std::int64_t sum = 0;
    std::int64_t count = 0;
    for (std::size_t y = row - std::min(row, kNoiseReach);
         y < std::min<std::size_t>(row + kNoiseReach + 1, size.height); ++y)
      for (std::size_t x = column - std::min(column, kNoiseReach);
           x < std::min<std::size_t>(column + kNoiseReach + 1, size.width); ++x) {
        sum += values[y * size.width + x];
        count += common[y * size.width + x];
      }
    const auto m = static_cast<double>(count);
    const double d = values[row * size.width + column] - static_cast<double>(sum) / m;
    to.squares += d * d;
    to.shares += 1 - 1 / m;
  }
};

double noise_of(const CommonDifferences& differences) {
  const PictureSize size = differences.size;
  const auto rows = for_rows<Deviations>(size.height, [&](std::size_t row) {
    Deviations of_row;
    for (std::size_t column = 0; column < size.width; ++column)
      if (differences.common[row * size.width + column] != 0)
        differences.add_deviation(row, column, of_row);
    return of_row;
  });
  Deviations sum;
  for (const Deviations& row : rows) {
    sum.squares += row.squares;
    sum.shares += row.shares;
  }
  return sum.squares == 0 ? 0 : std::sqrt(sum.squares / sum.shares) / kLevelParts;
}

int largest_difference(const Picture& a, const Picture& b, std::size_t pixel) {
  int largest = 0;
  for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i)
    largest = std::max(largest, std::abs(int{a.rgb[i]} - int{b.rgb[i]}));
  return largest;
}

void check_sizes(const Picture& a, const Picture& b) {
  CAIRN_CHECK(a.size == b.size && !a.rgb.empty());
  CAIRN_CHECK(a.rgb.size() == std::size_t{3} * a.size.width * a.size.height);
  CAIRN_CHECK(a.rgb.size() == b.rgb.size());
}

}  // namespace

double PictureDifference::psnr() const { return 10 * std::log10(255.0 * 255.0 / mse); }

PictureDifference difference_of(const CoveredPicture& full, const CoveredPicture& other) {
  const Picture& a = full.picture;
  const Picture& b = other.picture;
  check_sizes(a, b);
  const std::size_t pixels = a.rgb.size() / 3;
  CAIRN_CHECK(full.covered.size() == pixels && other.covered.size() == pixels);
  std::uint64_t squares = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const int levels = int{a.rgb[i]} - int{b.rgb[i]};
    squares += static_cast<std::uint64_t>(levels * levels);
  }
  const Luminance x = luminance_of(a);
  const Luminance y = luminance_of(b);
  CommonDifferences common{a.size, std::vector<std::int32_t>(pixels),
                           std::vector<std::uint8_t>(pixels)};
  std::uint64_t differ = 0, holes = 0, extra = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    differ += largest_difference(a, b, i) > kDifferentLevels ? 1 : 0;
    holes += full.covered[i] > other.covered[i] ? 1 : 0;
    extra += full.covered[i] < other.covered[i] ? 1 : 0;
    common.common[i] = full.covered[i] & other.covered[i];
    common.values[i] = common.common[i] != 0 ? y[i] - x[i] : 0;
  }
  const auto share = [&](std::uint64_t of) {
    return static_cast<double>(of) / static_cast<double>(pixels);
  };
  return {.mse = share(squares) / 3,
          .ssim = mean_ssim(x, y, a.size),
          .differ = share(differ),
          .holes = share(holes),
          .extra = share(extra),
          .noise = noise_of(common)};
}

PictureDifference mean_of(const std::vector<PictureDifference>& differences) {
  CAIRN_CHECK(!differences.empty());
  const auto mean = [&](double PictureDifference::*measure) {
    double sum = 0;
    for (const PictureDifference& difference : differences) sum += difference.*measure;
    return sum / static_cast<double>(differences.size());
  };
  return {.mse = mean(&PictureDifference::mse),
          .ssim = mean(&PictureDifference::ssim),
          .differ = mean(&PictureDifference::differ),
          .holes = mean(&PictureDifference::holes),
          .extra = mean(&PictureDifference::extra),
          .noise = mean(&PictureDifference::noise)};
}

Picture amplified_difference(const Picture& a, const Picture& b, int factor) {
  check_sizes(a, b);
  Picture result{.size = a.size, .rgb = std::vector<std::uint8_t>(a.rgb.size())};
  for (std::size_t i = 0; i < a.rgb.size(); ++i)
    result.rgb[i] =
        static_cast<std::uint8_t>(std::min(255, factor * std::abs(int{a.rgb[i]} - int{b.rgb[i]})));
  return result;
}

}  // namespace cairn::viewer
