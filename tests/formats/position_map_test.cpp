// Fits of LAS steps on a grid. What must fit are scales and offsets that are decimal fractions; the expected
// numbers are theirs, worked out by hand.
#include "formats/scans/position_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cairn::formats {
namespace {

TEST(FitAxis, DecimalScalesFitTheirDecimalParts) {
  const double scales[] = {1, 0.1, 0.01, 0.001, 0.0001, 0.00001, 0.000001, 0.0000001};
  std::int64_t factor = 1;
  for (std::size_t apart = 0; apart < 8; ++apart, factor *= 10)
    for (std::size_t i = 0; i + apart < 8; ++i) {
      for (const double units : {1.0, 3.0, 7.0, 25.0}) {
        const auto fit = fit_axis(units * scales[i], 0, scales[i + apart], 0);
        ASSERT_TRUE(fit) << units << " * " << scales[i] << " on " << scales[i + apart];
        EXPECT_EQ(fit->factor, factor * static_cast<std::int64_t>(units));
      }
    }
}

TEST(FitAxis, NearlyEqualScalesDoNotFit) {
  EXPECT_FALSE(fit_axis(0.01, 0, static_cast<double>(0.01F), 0));
  EXPECT_FALSE(fit_axis(0.01 * (1 + 1e-12), 0, 0.01, 0));  // off by 0.002 steps at 2^31
  EXPECT_TRUE(fit_axis(std::nextafter(0.01, 1), 0, 0.01, 0));
}

TEST(FitAxis, LargeDecimalOffsetsFit) {
  // 5,300,000.123 / 0.0001 is 53 billion steps, each offset rounded to 9e-6 of a step.
  const auto fit = fit_axis(0.0001, 5300000.1234, 0.0001, -1.3);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->addend, 53000014234);
  for (int i = 0; i < 1000; ++i) {
    const double offset = static_cast<double>(6378000000 + i) / 1000;  // the nearest double
    const auto apart = fit_axis(0.001, offset, 0.001, -4000000.001);
    ASSERT_TRUE(apart) << i;
    EXPECT_EQ(apart->addend, 6378000000 + i + 4000000001);
  }
}

TEST(FitAxis, OffsetsAFractionOfAStepApartDoNotFit) {
  EXPECT_FALSE(fit_axis(0.01, 12.345, 0.01, 0));
  EXPECT_FALSE(fit_axis(0.01, 0.00001, 0.01, 0));  // a thousandth of a step
  EXPECT_FALSE(fit_axis(0.001, 5000000.00001, 0.001, 0));
}

}  // namespace
}  // namespace cairn::formats
