// What pictures lose, against closed forms and against the formulas written out pixel by pixel.
#include "viewer/picture_difference.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <random>

namespace cairn::viewer {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

CoveredPicture plain(PictureSize size, Rgb color) {
  CoveredPicture shown{.picture = {.size = size, .rgb = {}}, .covered = {}};
  const std::size_t pixels = std::size_t{size.width} * size.height;
  for (std::size_t i = 0; i < pixels; ++i)
    shown.picture.rgb.insert(shown.picture.rgb.end(), color.begin(), color.end());
  shown.covered.assign(pixels, 1);
  return shown;
}

CoveredPicture random_picture(PictureSize size, unsigned seed, double share_covered = 1) {
  std::mt19937 random(seed);
  CoveredPicture shown = plain(size, {0, 0, 0});
  for (auto& byte : shown.picture.rgb) byte = static_cast<std::uint8_t>(random() % 256);
  for (auto& covered : shown.covered)
    covered = std::bernoulli_distribution(share_covered)(random) ? 1 : 0;
  return shown;
}

double luminance(const CoveredPicture& shown, int x, int y) {
  const std::size_t i = 3 * (static_cast<std::size_t>(y) * shown.picture.size.width + x);
  const auto& rgb = shown.picture.rgb;
  return 0.299 * rgb[i] + 0.587 * rgb[i + 1] + 0.114 * rgb[i + 2];
}

/// Every window by itself, with weights of the plane and central moments.
double brute_ssim(const CoveredPicture& a, const CoveredPicture& b) {
  const int width = static_cast<int>(a.picture.size.width);
  const int height = static_cast<int>(a.picture.size.height);
  double weights = 0;
  const auto weight = [](int dx, int dy) { return std::exp((dx * dx + dy * dy) / -4.5); };
  for (int dy = -5; dy <= 5; ++dy)
    for (int dx = -5; dx <= 5; ++dx) weights += weight(dx, dy);
  double sum = 0;
  for (int y = 5; y < height - 5; ++y)
    for (int x = 5; x < width - 5; ++x) {
      const auto mean = [&](const auto& value) {
        double total = 0;
        for (int dy = -5; dy <= 5; ++dy)
          for (int dx = -5; dx <= 5; ++dx)
            total += weight(dx, dy) / weights *
                     value(luminance(a, x + dx, y + dy), luminance(b, x + dx, y + dy));
        return total;
      };
      const double ma = mean([](double p, double) { return p; });
      const double mb = mean([](double, double q) { return q; });
      const double va = mean([&](double p, double) { return (p - ma) * (p - ma); });
      const double vb = mean([&](double, double q) { return (q - mb) * (q - mb); });
      const double vab = mean([&](double p, double q) { return (p - ma) * (q - mb); });
      sum += (2 * ma * mb + 6.5025) / (ma * ma + mb * mb + 6.5025) * (2 * vab + 58.5225) /
             (va + vb + 58.5225);
    }
  return sum / ((width - 10) * (height - 10));
}

/// Every neighborhood as a list of values.
double brute_noise(const CoveredPicture& full, const CoveredPicture& other) {
  const int width = static_cast<int>(full.picture.size.width);
  const int height = static_cast<int>(full.picture.size.height);
  const auto common = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= height) return false;
    const std::size_t i = static_cast<std::size_t>(y) * width + x;
    return full.covered[i] == 1 && other.covered[i] == 1;
  };
  const auto difference = [&](int x, int y) {
    return luminance(other, x, y) - luminance(full, x, y);
  };
  double squares = 0, shares = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!common(x, y)) continue;
      std::vector<double> around;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          if (common(x + dx, y + dy)) around.push_back(difference(x + dx, y + dy));
      double mean = 0;
      for (const double value : around) mean += value / static_cast<double>(around.size());
      squares += std::pow(difference(x, y) - mean, 2);
      shares += 1 - 1.0 / static_cast<double>(around.size());
    }
  return std::sqrt(squares / shares);
}

TEST(PictureDifference, EqualPicturesDifferInNothing) {
  const CoveredPicture a = random_picture({40, 30}, 1, 0.5);
  const PictureDifference same = difference_of(a, a);
  EXPECT_EQ(same.psnr(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(same.ssim, 1);
  for (const double none : {same.mse, same.differ, same.holes, same.extra, same.noise})
    EXPECT_EQ(none, 0);
}

TEST(PictureDifference, AConstantShiftHasTheDecibelsOfItsLevels) {
  const CoveredPicture a = plain({32, 20}, {100, 120, 140});
  for (const int shift : {1, 8, 9, 80}) {
    const auto s = static_cast<std::uint8_t>(shift);
    const auto b =
        plain({32, 20}, {static_cast<std::uint8_t>(100 + s), static_cast<std::uint8_t>(120 + s),
                         static_cast<std::uint8_t>(140 + s)});
    const PictureDifference found = difference_of(a, b);
    EXPECT_NEAR(found.psnr(), 20 * std::log10(255.0 / shift), 1e-12);
    EXPECT_EQ(found.differ, shift > 8 ? 1 : 0);
    EXPECT_EQ(found.noise, 0) << "the same everywhere";
  }
}

TEST(PictureDifference, SsimOfConstantPicturesIsThatOfTheirMeans) {
  const double a = 0.299 * 200 + 0.587 * 10 + 0.114 * 90, b = 0.299 * 20 + 0.587 * 70 + 0.114 * 5;
  const double c1 = 2.55 * 2.55;
  const auto found = difference_of(plain({11, 15}, {200, 10, 90}), plain({11, 15}, {20, 70, 5}));
  EXPECT_NEAR(found.ssim, (2 * a * b + c1) / (a * a + b * b + c1), 1e-10);
}

TEST(PictureDifference, SsimIsThatOfTheFormulaWindowByWindow) {
  const CoveredPicture a = random_picture({37, 24}, 1);
  CoveredPicture b = a;
  std::mt19937 random(2);
  for (auto& byte : b.picture.rgb)
    byte = static_cast<std::uint8_t>((byte * 3 + static_cast<int>(random() % 256)) / 4);
  const double expected = brute_ssim(a, b);
  EXPECT_GT(expected, 0.5);
  EXPECT_LT(expected, 0.99);
  EXPECT_NEAR(difference_of(a, b).ssim, expected, 1e-10);
  EXPECT_NEAR(difference_of(a, random_picture({37, 24}, 9)).ssim,
              brute_ssim(a, random_picture({37, 24}, 9)), 1e-10);
}

TEST(PictureDifference, SsimIsNotDefinedWithoutRoomForAWindow) {
  for (const PictureSize size : {PictureSize{10, 50}, {50, 10}, {1, 1}})
    EXPECT_TRUE(std::isnan(difference_of(plain(size, {1, 2, 3}), plain(size, {1, 2, 3})).ssim));
  EXPECT_EQ(difference_of(plain({11, 11}, {1, 2, 3}), plain({11, 11}, {1, 2, 3})).ssim, 1);
}

TEST(PictureDifference, CountsWhatOnlyOneOfThePicturesDraws) {
  CoveredPicture full = plain({10, 10}, {9, 9, 9}), other = full;
  for (const std::size_t hole : {3U, 50U, 99U}) other.covered[hole] = 0;
  for (const std::size_t extra : {0U, 51U}) full.covered[extra] = 0;
  full.covered[7] = other.covered[7] = 0;
  const PictureDifference found = difference_of(full, other);
  EXPECT_EQ(found.holes, 0.03);
  EXPECT_EQ(found.extra, 0.02);
  EXPECT_EQ(found.differ, 0);
}

TEST(PictureDifference, NoiseIsThatOfTheFormulaPixelByPixel) {
  for (const double covered : {1.0, 0.6, 0.1}) {
    const CoveredPicture full = random_picture({30, 17}, 3, covered);
    const CoveredPicture other = random_picture({30, 17}, 4, covered);
    EXPECT_NEAR(difference_of(full, other).noise, brute_noise(full, other), 1e-9) << covered;
  }
}

// Normal noise rounded to levels has the variance of both.
TEST(PictureDifference, NoiseIsTheStandardDeviationOfIndependentPixelsHoweverFewAreDrawn) {
  for (const double covered : {1.0, 0.2}) {
    CoveredPicture full = random_picture({400, 300}, 5, covered);
    std::fill(full.picture.rgb.begin(), full.picture.rgb.end(), std::uint8_t{100});
    CoveredPicture other = full;
    std::mt19937 random(6);
    std::normal_distribution<double> level(130, 12);
    for (std::size_t i = 0; i < other.picture.rgb.size(); i += 3)
      std::fill_n(&other.picture.rgb[i], 3, static_cast<std::uint8_t>(std::lround(level(random))));
    EXPECT_NEAR(difference_of(full, other).noise, std::sqrt(144 + 1.0 / 12), 0.3) << covered;
  }
}

TEST(PictureDifference, ThreadsDoNotChangeABit) {
  const CoveredPicture a = random_picture({150, 90}, 7, 0.8), b = random_picture({150, 90}, 8, 0.8);
  const auto measured = [&](int threads) {
    PictureDifference found;
    tbb::task_arena(threads).execute([&] { found = difference_of(a, b); });
    return found;
  };
  const PictureDifference one = measured(1), many = measured(4);
  EXPECT_EQ(one.ssim, many.ssim);
  EXPECT_EQ(one.noise, many.noise);
}

TEST(PictureDifference, MeansAreOfSquaredDifferencesNotOfDecibels) {
  const PictureDifference mean =
      mean_of({{.mse = 0, .ssim = 1, .holes = 0.5, .noise = 2}, {.mse = 50, .ssim = 0.5}});
  EXPECT_NEAR(mean.psnr(), 20 * std::log10(255.0 / 5), 1e-12);
  EXPECT_EQ(mean.ssim, 0.75);
  EXPECT_EQ(mean.holes, 0.25);
  EXPECT_EQ(mean.noise, 1);
}

TEST(PictureDifference, IsAmplifiedUpToWhite) {
  const Picture a = plain({1, 1}, {10, 20, 200}).picture, b = plain({1, 1}, {13, 20, 100}).picture;
  EXPECT_EQ(amplified_difference(a, b, 8).rgb, (std::vector<std::uint8_t>{24, 0, 255}));
}

}  // namespace
}  // namespace cairn::viewer
