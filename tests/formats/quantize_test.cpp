#include "formats/dataset/quantize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "formats/error.h"

namespace cairn::formats {
namespace {

__extension__ using Int128 = __int128;

GridBox box_of_span(std::int32_t min, std::uint32_t span) {
  const auto max = static_cast<std::int32_t>(static_cast<std::int64_t>(min) + span);
  return {{min, min, min}, {max, max, max}};
}

std::uint32_t encode_one(const PositionQuantizer& quantizer, std::int32_t x) {
  const GridPoint point{x, x, x};
  std::array<std::uint32_t, 3> codes;
  quantizer.encode(std::span(&point, 1), codes);
  return codes[0];
}

std::int32_t decode_one(const PositionQuantizer& quantizer, std::uint32_t code) {
  const std::array<std::uint32_t, 3> codes{code, code, code};
  GridPoint point;
  quantizer.decode(codes, std::span(&point, 1));
  return point[0];
}

/// round(a * b / c), half up, in exact rational arithmetic: the definition.
std::uint32_t rounded(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return static_cast<std::uint32_t>((2 * Int128(a) * Int128(b) + Int128(c)) / (2 * Int128(c)));
}

TEST(PositionQuantizer, IsExactWhereTheSpanFits) {
  for (const std::uint32_t span : {0u, 1u, 2u, 65534u, 65535u}) {
    const PositionQuantizer quantizer(box_of_span(-1000, span), 16);
    EXPECT_TRUE(quantizer.exact());
    EXPECT_EQ(quantizer.max_error_steps(0), 0u);
    for (std::uint32_t d = 0; d <= span; ++d) {
      const auto x = -1000 + static_cast<std::int32_t>(d);
      ASSERT_EQ(encode_one(quantizer, x), d);
      ASSERT_EQ(decode_one(quantizer, d), x);
    }
  }
  EXPECT_FALSE(PositionQuantizer(box_of_span(0, 65536), 16).exact());
}

TEST(PositionQuantizer, IsExactOverTheWholeRangeWith32Bits) {
  const GridBox box{{INT32_MIN, INT32_MIN, INT32_MIN}, {INT32_MAX, INT32_MAX, INT32_MAX}};
  const PositionQuantizer quantizer(box, 32);
  EXPECT_TRUE(quantizer.exact());
  for (const std::int32_t x : {INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX})
    EXPECT_EQ(decode_one(quantizer, encode_one(quantizer, x)), x);
}

TEST(PositionQuantizer, BoundIsReachedAndNeverExceededForEverySmallSpan) {
  for (unsigned bits = 1; bits <= 6; ++bits) {
    for (std::uint32_t span = 0; span <= 700; ++span) {
      const PositionQuantizer quantizer(box_of_span(-350, span), bits);
      std::int64_t worst = 0;
      std::uint32_t before = 0;
      for (std::uint32_t d = 0; d <= span; ++d) {
        const std::int32_t x = -350 + static_cast<std::int32_t>(d);
        const std::uint32_t code = encode_one(quantizer, x);
        ASSERT_GE(code, before) << "not monotone";
        before = code;
        const std::int32_t back = decode_one(quantizer, code);
        ASSERT_TRUE(quantizer.box().contains(GridPoint{back, back, back}));
        worst = std::max<std::int64_t>(worst, std::abs(back - x));
      }
      ASSERT_LE(worst, quantizer.max_error_steps(0)) << "span " << span << ", bits " << bits;
      // Half up on both ways: in some spans no point meets the worst of both at once.
      ASSERT_GE(worst + 1, quantizer.max_error_steps(0)) << "span " << span << ", bits " << bits;
    }
  }
}

TEST(PositionQuantizer, AgreesWithRationalArithmetic) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 200'000; ++round) {
    const unsigned bits = 1 + static_cast<unsigned>(random() % 31);
    const std::uint64_t levels = (std::uint64_t{1} << bits) - 1;
    std::uint32_t span = static_cast<std::uint32_t>(random()) >> (random() % 32);
    if (round % 8 == 0) span = UINT32_MAX - static_cast<std::uint32_t>(random() % 4);
    if (span <= levels) continue;
    const auto min = static_cast<std::int32_t>(
        INT32_MIN + static_cast<std::int64_t>(random() % (UINT32_MAX - span + 1ull)));
    const PositionQuantizer quantizer(box_of_span(min, span), bits);
    const std::uint32_t d = round % 3 == 0
                                ? span - static_cast<std::uint32_t>(random() % 2)
                                : static_cast<std::uint32_t>(random() % (std::uint64_t{span} + 1));
    const auto x = static_cast<std::int32_t>(std::int64_t{min} + d);
    const std::uint32_t code = encode_one(quantizer, x);
    ASSERT_EQ(code, rounded(d, levels, span))
        << "d " << d << ", span " << span << ", bits " << bits;
    const std::int32_t back = decode_one(quantizer, code);
    ASSERT_EQ(std::int64_t{back} - min, rounded(code, span, levels)) << "code " << code;
    ASSERT_LE(std::abs(std::int64_t{back} - x), quantizer.max_error_steps(0));
  }
}

TEST(PositionQuantizer, EndsOfTheBoxDecodeToThemselves) {
  for (unsigned bits = 1; bits <= 32; ++bits) {
    const PositionQuantizer quantizer({{INT32_MIN, -5, 7}, {INT32_MAX, 1'000'000'000, 7}}, bits);
    const std::array<GridPoint, 2> ends{quantizer.box().min, quantizer.box().max};
    std::array<std::uint32_t, 6> codes;
    quantizer.encode(ends, codes);
    std::array<GridPoint, 2> back;
    quantizer.decode(codes, back);
    EXPECT_EQ(back, ends) << bits << " bits";
  }
}

TEST(PositionQuantizer, FindsCodesThatAreNone) {
  // Largest codes: the span of 20, 2^12 - 1, the span of 3.
  const PositionQuantizer quantizer({{-10, 0, INT32_MAX - 3}, {10, 1'000'000, INT32_MAX}}, 12);
  const std::array<std::uint16_t, 6> right{20, 4095, 3, 0, 0, 0};
  EXPECT_EQ(quantizer.first_beyond(right), std::nullopt);
  for (std::size_t i = 0; i < 6; ++i)
    for (const int code : {right[i % 3] + 1, 65535}) {
      std::array<std::uint16_t, 6> wrong = right;
      wrong[i] = static_cast<std::uint16_t>(code);
      EXPECT_EQ(quantizer.first_beyond(wrong), i) << code;
    }
  const std::array<std::uint32_t, 3> wide{20, 4095, 0xFFFFFFFF};
  EXPECT_EQ(quantizer.first_beyond(wide), 2U);
}

TEST(PositionQuantizer, SixteenBitCodesEqualWideOnes) {
  std::mt19937 random(3);
  const PositionQuantizer quantizer({{-40'000, -9, 0}, {40'000, 90'000'000, 60'000}}, 16);
  std::vector<GridPoint> points(1001);
  for (GridPoint& p : points)
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = quantizer.box().min[a] +
             static_cast<std::int32_t>(random() % (quantizer.box().span(static_cast<int>(a)) + 1));
  std::vector<std::uint16_t> narrow(3003);
  std::vector<std::uint32_t> wide(3003);
  quantizer.encode(points, narrow);
  quantizer.encode(points, wide);
  EXPECT_TRUE(std::equal(narrow.begin(), narrow.end(), wide.begin()));
  std::vector<GridPoint> from_narrow(1001);
  std::vector<GridPoint> from_wide(1001);
  quantizer.decode(narrow, from_narrow);
  quantizer.decode(wide, from_wide);
  EXPECT_EQ(from_narrow, from_wide);
}

TEST(PositionQuantizer, RefusesWhatItCannotDo) {
  EXPECT_THROW(PositionQuantizer(box_of_span(0, 1), 0), Error);
  EXPECT_THROW(PositionQuantizer(box_of_span(0, 1), 33), Error);
  EXPECT_THROW(PositionQuantizer(GridBox{}, 16), Error);
  const PositionQuantizer quantizer(box_of_span(0, 1), 17);
  const GridPoint point{};
  std::array<std::uint16_t, 3> codes;
  EXPECT_THROW(quantizer.encode(std::span(&point, 1), codes), Error);
}

/// Every radius worth asking for between two extremes: random ones, the table's and their neighbours.
std::vector<float> radii_between(float min, float max, const RadiusQuantizer& quantizer) {
  std::mt19937 random(11);
  std::vector<float> radii{min, max};
  for (int i = 0; i < 2000; ++i)
    radii.push_back(static_cast<float>(
        double{min} + (double{max} - min) * (static_cast<double>(random()) / 4294967296.0)));
  for (int code = 0; code < 256; ++code) {
    const float r = quantizer.decode(static_cast<std::uint8_t>(code));
    radii.insert(radii.end(), {r, std::nextafter(r, min), std::nextafter(r, max)});
  }
  for (float& r : radii) r = std::clamp(r, min, max);
  return radii;
}

TEST(RadiusQuantizer, DecodedCoversOriginalByLessThanALevel) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const float huge = std::numeric_limits<float>::max();
  const std::vector<std::pair<float, float>> extremes{
      {0.0f, 1.0f},    {0.001f, 0.00101f}, {0.5f, std::nextafter(0.5f, 1.0f)},
      {0.0f, tiny},    {tiny, 9 * tiny},   {0.0f, huge},
      {1e-30f, 1e30f}, {0.1f, 0.7f},       {3.0f, 3.0f},
      {0.0f, 0.0f},    {-huge, huge},      {1.0f, std::nextafter(1.0f, 2.0f) + 1e-6f}};
  for (const auto& [min, max] : extremes) {
    const RadiusQuantizer quantizer(min, max);
    EXPECT_EQ(quantizer.decode(quantizer.encode(min)), min);
    EXPECT_EQ(quantizer.decode(quantizer.encode(max)), max);
    for (const float r : radii_between(min, max, quantizer)) {
      const std::uint8_t code = quantizer.encode(r);
      const float back = quantizer.decode(code);
      ASSERT_GE(back, r);
      ASSERT_LE(back, max);
      ASSERT_TRUE(code == 0 || quantizer.decode(static_cast<std::uint8_t>(code - 1)) < r)
          << "not the smallest code";
      ASSERT_LE(double{back} - double{r}, double{quantizer.max_error()})
          << r << " between " << min << " and " << max;
    }
  }
}

TEST(RadiusQuantizer, EqualExtremesGiveCodeZero) {
  const RadiusQuantizer quantizer(0.25f, 0.25f);
  EXPECT_EQ(quantizer.encode(0.25f), 0);
  EXPECT_EQ(quantizer.max_error(), 0.0f);
}

TEST(RadiusQuantizer, TakesWhatItShouldNotMeetToTheLargest) {
  const RadiusQuantizer quantizer(1.0f, 2.0f);
  EXPECT_EQ(quantizer.encode(std::numeric_limits<float>::quiet_NaN()), 255);
  EXPECT_EQ(quantizer.encode(std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(quantizer.encode(-1.0f), 0);
}

TEST(RadiusQuantizer, RefusesExtremesThatAreNotFiniteAndOrdered) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_THROW(RadiusQuantizer(2.0f, 1.0f), Error);
  EXPECT_THROW(RadiusQuantizer(nan, 1.0f), Error);
  EXPECT_THROW(RadiusQuantizer(0.0f, nan), Error);
  EXPECT_THROW(RadiusQuantizer(0.0f, infinity), Error);
}

}  // namespace
}  // namespace cairn::formats
