// Sine and cosine against the C library's of more digits, and spherical coordinates against their definition.
#include "formats/scans/e57/spherical.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace cairn::formats {
namespace {

TEST(Spherical, SineAndCosineAreTheLibrarysToTwoUnitsOfTheLastPlace) {
  constexpr double kTolerance = 2.3e-16;
  for (int i = -40000; i <= 40000; ++i)
    for (const double step : {0.000314159, 0.0007, 1.0 / 3, 23.7}) {
      const double angle = i * step;
      const SineCosine found = sine_cosine(angle);
      ASSERT_NEAR(found.sine, static_cast<double>(std::sin(static_cast<long double>(angle))),
                  kTolerance)
          << angle;
      ASSERT_NEAR(found.cosine, static_cast<double>(std::cos(static_cast<long double>(angle))),
                  kTolerance)
          << angle;
    }
}

TEST(Spherical, MultiplesOfAQuarterTurnAreAxes) {
  for (int quarters = -8; quarters <= 8; ++quarters) {
    const SineCosine found = sine_cosine(quarters * (std::numbers::pi / 2));
    const int phase = ((quarters % 4) + 4) % 4;
    EXPECT_NEAR(found.sine, phase == 1 ? 1 : phase == 3 ? -1 : 0, 1e-15);
    EXPECT_NEAR(found.cosine, phase == 0 ? 1 : phase == 2 ? -1 : 0, 1e-15);
  }
}

TEST(Spherical, WhatIsNoAngleGivesNoNumber) {
  for (const double angle :
       {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(sine_cosine(angle).sine));
    EXPECT_TRUE(std::isnan(sine_cosine(angle).cosine));
  }
  const SineCosine far = sine_cosine(1e300);
  EXPECT_NEAR(far.sine * far.sine + far.cosine * far.cosine, 1, 1e-15);
}

TEST(Spherical, AnglesGoFromXToYAndUpToZ) {
  const auto expect = [](const Vector3& found, const Vector3& expected) {
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], expected[axis], 1e-15);
  };
  constexpr double kQuarter = std::numbers::pi / 2;
  expect(from_spherical(2, 0, 0), {2, 0, 0});
  expect(from_spherical(2, kQuarter, 0), {0, 2, 0});
  expect(from_spherical(2, 0, kQuarter), {0, 0, 2});
  expect(from_spherical(2, kQuarter / 2, kQuarter / 3),
         {std::sqrt(3.0) / std::numbers::sqrt2, std::sqrt(3.0) / std::numbers::sqrt2, 1});
}

}  // namespace
}  // namespace cairn::formats
