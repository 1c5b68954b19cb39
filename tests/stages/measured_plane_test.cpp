#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/support/measured_geometry.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;

/// Points at random in a square of `side` steps, tilted about two axes.
std::vector<GridPoint> tilted_plane(std::size_t count, double side, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> along(0, side);
  const double u[3] = {0.8, 0.36, 0.48}, v[3] = {-0.6, 0.48, 0.64};
  std::vector<GridPoint> points(count);
  for (GridPoint& p : points) {
    const double a = along(random), b = along(random);
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = static_cast<std::int32_t>(std::lround(a * u[k] + b * v[k]));
  }
  return points;
}

/// RMS distance, over that of hexagons, from the nearest of points that lie at random: sqrt(A / (pi k)).
const double kRandomOverLimit = std::sqrt(18 * std::numbers::sqrt3 / (5 * std::numbers::pi));

/// RMS distances on the root, over that of the best there is: the centers of regular hexagons, from which the points of
/// a plane are sqrt(5 / (18 sqrt(3)) A / k), for k of them on an area A.
struct OverLimit {
  double assigned, nearest;
};

class LongMeasuredPlane : public test::MeasuredGeometry {
 protected:
  static void SetUpTestSuite() { cloud = tilted_plane(kPoints, kSide, 3); }
  static void TearDownTestSuite() { cloud = {}; }

  /// After three levels, with 64 points a representative.
  OverLimit measure_plane(const std::string& reducer, const ClusterOptions& clustering = {}) {
    const auto path = build({.points = cloud,
                             .scale = {kScale, kScale, kScale},
                             .offset = {5e5, 5e6, 300},
                             .node_points = kPoints / 64,
                             .reducer = reducer,
                             .clustering = clustering});
    const ErrorReport report = measure(path, {.sample = 200'000});
    EXPECT_EQ(report.levels.size(), 3U);
    const LevelError& root = report.levels.front();
    EXPECT_EQ(root.points, kPoints / 64);
    const double area = kSide * kScale * kSide * kScale;
    const double limit =
        std::sqrt(5 / (18 * std::numbers::sqrt3) * area / static_cast<double>(root.points));
    const OverLimit over{root.rms / limit, root.geometry.surface.value().nearest.rms / limit};
    EXPECT_GE(over.nearest, 1);
    EXPECT_GE(over.assigned, over.nearest);
    RecordProperty("assigned", std::to_string(over.assigned));
    RecordProperty("nearest", std::to_string(over.nearest));
    return over;
  }

 private:
  static constexpr std::size_t kPoints = std::size_t{1} << 20;
  static constexpr double kSide = 2e7, kScale = 1e-4;
  static inline std::vector<GridPoint> cloud;
};

TEST_F(LongMeasuredPlane, ClustersComeNearTheHexagonalLimit) {
  const OverLimit cluster = measure_plane("cluster");
  EXPECT_LE(cluster.assigned, 1.10);
  EXPECT_LE(cluster.nearest, 1.03);
}

TEST_F(LongMeasuredPlane, InCellsOfManyPointsTheyComeNearer) {
  EXPECT_LE(measure_plane("cluster", {.grid = 5}).assigned, 1.055);
}

TEST_F(LongMeasuredPlane, RandomOnesAreAsFarAsTheoryTells) {
  EXPECT_NEAR(measure_plane("random").nearest, kRandomOverLimit, 0.01);
}

TEST_F(LongMeasuredPlane, OtherReducersAreBetween) {
  const OverLimit cluster = measure_plane("cluster");
  for (const char* reducer : {"average", "weighted", "first"}) {
    const OverLimit other = measure_plane(reducer);
    EXPECT_GT(other.nearest, cluster.nearest) << reducer;
    EXPECT_GT(other.assigned, cluster.assigned) << reducer;
    EXPECT_LT(other.nearest, kRandomOverLimit) << reducer;
  }
}

}  // namespace
}  // namespace cairn::stages
