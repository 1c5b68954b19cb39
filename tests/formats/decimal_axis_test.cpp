// Grid coordinates as decimals, against numbers written out and against what a parser makes of them.
#include "formats/scans/decimal_axis.h"

#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <random>
#include <string>

namespace cairn::formats {
namespace {

std::string text_of(double step, double offset, std::int32_t i) {
  const auto axis = DecimalAxis::of(step, offset);
  if (!axis) return "none";
  char text[DecimalAxis::kMostBytes];
  return {text, axis->write(text, i)};
}

TEST(DecimalAxis, WritesTheDecimalsThatTheGridMeans) {
  EXPECT_EQ(text_of(0.01, 0, 63701232), "637012.32");
  EXPECT_EQ(text_of(0.01, 0, -5), "-0.05");
  EXPECT_EQ(text_of(0.01, 0, 0), "0.00");
  EXPECT_EQ(text_of(0.001, 4'100'000, -1), "4099999.999");
  EXPECT_EQ(text_of(0.01, 0.005, -1), "-0.005");
  EXPECT_EQ(text_of(0.00025, 1, 3), "1.00075");
  EXPECT_EQ(text_of(1, 0, INT32_MIN), "-2147483648");
  EXPECT_EQ(text_of(20, 3, 7), "143");
  EXPECT_EQ(text_of(0.25, -0.5, 1), "-0.25");
  // As a product of doubles it is the one above.
  EXPECT_NE(0.01 * 63701232, 637012.32);
}

TEST(DecimalAxis, LeavesBinaryGridsAndTooManyDigitsToDoubles) {
  EXPECT_EQ(text_of(std::ldexp(1, -22), 0, 1), "none");
  EXPECT_EQ(text_of(0.01, 1.0 / 3, 1), "none");
  EXPECT_EQ(text_of(1e-12, 1e12, 1), "none");
  EXPECT_EQ(text_of(0.01, 1e300, 1), "none");
  EXPECT_EQ(text_of(1e-13, 0, 1), "none");
  EXPECT_EQ(text_of(1e8, 0, INT32_MAX), "214748364700000000");
}

TEST(DecimalAxis, GivesEveryStepBack) {
  std::mt19937_64 random(7);
  for (int turn = 0; turn < 20'000; ++turn) {
    const double step =
        std::pow(10, -static_cast<int>(random() % 7)) * static_cast<double>(1 + random() % 25);
    const double offset = std::round(std::uniform_real_distribution(-5e6, 5e6)(random));
    const auto i = static_cast<std::int32_t>(random());
    const std::string text = text_of(step, offset, i);
    if (text == "none") continue;  // 7.000000000000001e-05 and the like
    ASSERT_LE(text.size(), DecimalAxis::kMostBytes);
    double back = 0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    ASSERT_EQ(std::llround((back - offset) / step), i) << text;
    ASSERT_NEAR(back, offset + step * i, std::ldexp(std::fabs(back) + std::fabs(offset), -51));
  }
}

}  // namespace
}  // namespace cairn::formats
