#include "formats/dataset/normal_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <vector>

namespace cairn::formats {
namespace {

double dot(const Normal& a, const Normal& b) {
  return double{a[0]} * b[0] + double{a[1]} * b[1] + double{a[2]} * b[2];
}

double degrees_between(const Normal& n, const Normal& unit) {
  const double length = std::sqrt(dot(n, n));
  double squared = 0;
  for (std::size_t a = 0; a < 3; ++a)
    squared += (n[a] / length - unit[a]) * (n[a] / length - unit[a]);
  return 2 * std::asin(std::min(1.0, std::sqrt(squared) / 2)) * 180 / std::numbers::pi;
}

Normal random_normal(std::mt19937_64& random) {
  std::normal_distribution<float> gauss;
  return {gauss(random), gauss(random), gauss(random)};
}

TEST(NormalMap, EveryCodeIsADifferentUnitVectorThatEncodesToItself) {
  std::set<Normal> seen;
  for (std::uint32_t code = 0; code < kNormalCodes; ++code) {
    const Normal& n = decode_normal(static_cast<std::uint16_t>(code));
    ASSERT_NEAR(std::sqrt(dot(n, n)), 1.0, 1e-7);
    ASSERT_EQ(encode_normal(n), code);
    seen.insert(n);
  }
  EXPECT_EQ(seen.size(), kNormalCodes);
  EXPECT_EQ(kNormalCodes, 6u * 104u * 104u + 2u);
}

TEST(NormalMap, FindsTheNearestOfAllCodes) {
  std::mt19937_64 random(1);
  std::vector<Normal> sample;
  for (int i = 0; i < 400; ++i) sample.push_back(random_normal(random));
  // Near the edges and the corners of the cube, where the codes of faces meet.
  for (int i = 0; i < 400; ++i) {
    Normal n = random_normal(random);
    const float wobble = 1e-2f * random_normal(random)[0];
    n[1] = (i % 4 < 2 ? n[0] : -n[0]) * (1 + wobble);
    if (i % 2 == 0) n[2] = (i % 8 < 4 ? n[0] : -n[0]) * (1 + 1e-2f * random_normal(random)[0]);
    sample.push_back(n);
  }
  for (const Normal& n : sample) {
    double best = -2;
    for (std::uint32_t code = 0; code < kNormalCodes; ++code)
      best = std::max(best, dot(n, decode_normal(static_cast<std::uint16_t>(code))));
    // Compared by the cosine, since rounding of the table decides between codes equally near.
    ASSERT_GE(dot(n, decode_normal(encode_normal(n))), best - 1e-7 * std::abs(best))
        << n[0] << ' ' << n[1] << ' ' << n[2];
  }
}

TEST(NormalMap, KeepsItsErrorBound) {
  std::mt19937_64 random(2);
  double worst = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Normal n = random_normal(random);
    worst = std::max(worst, degrees_between(n, decode_normal(encode_normal(n))));
  }
  EXPECT_LE(worst, kMaxNormalErrorDegrees);
  EXPECT_GE(worst, 0.97 * kMaxNormalErrorDegrees) << "the stated bound is needlessly wide";
}

TEST(NormalMap, AxesAndDiagonalsAreExact) {
  for (const float s : {1.0f, -1.0f}) {
    EXPECT_EQ(decode_normal(encode_normal({s, 0, 0})), (Normal{s, 0, 0}));
    EXPECT_EQ(decode_normal(encode_normal({0, s, 0})), (Normal{0, s, 0}));
    EXPECT_EQ(decode_normal(encode_normal({0, 0, s})), (Normal{0, 0, s}));
    const auto third = static_cast<float>(s / std::sqrt(3.0));
    EXPECT_EQ(decode_normal(encode_normal({s, s, s})), (Normal{third, third, third}));
    const auto half = static_cast<float>(s / std::sqrt(2.0));
    EXPECT_EQ(decode_normal(encode_normal({s, 0, -s})), (Normal{half, 0, -half}));
  }
}

TEST(NormalMap, LengthDoesNotMatter) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 1000; ++i) {
    const Normal n = random_normal(random);
    for (const float scale : {0x1p-100f, 0x1p-10f, 0x1p100f})
      ASSERT_EQ(encode_normal({n[0] * scale, n[1] * scale, n[2] * scale}), encode_normal(n));
  }
  const float tiny = std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(encode_normal({0, 0, -tiny}), encode_normal({0, 0, -1}));
  const float huge = std::numeric_limits<float>::max();
  EXPECT_EQ(encode_normal({huge, huge, huge}), encode_normal({1, 1, 1}));
}

TEST(NormalMap, NoDirectionHasACodeOfItsOwn) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<Normal> none{{0, 0, 0},         {-0.0f, 0, 0},      {nan, 0, 0},
                                 {0, nan, 1},       {1, 0, nan},        {infinity, 0, 0},
                                 {0, -infinity, 1}, {nan, infinity, 0}, {1, 1, -infinity}};
  for (const Normal& n : none) EXPECT_EQ(encode_normal(n), kNoNormal);
  for (std::uint32_t code = kNormalCodes; code <= 65535; ++code)
    EXPECT_EQ(decode_normal(static_cast<std::uint16_t>(code)), (Normal{0, 0, 0}));
}

}  // namespace
}  // namespace cairn::formats
