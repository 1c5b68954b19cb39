#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stages/measure/deviation.h"
#include "tests/support/measured_geometry.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::GridPoint;
using test::cloud;
using test::MeasuredGeometry;
using test::origin_of;
using test::random_points;

constexpr std::uint64_t kAll = MeasureOptions::kAllPoints;

void expect_equal(const SurfaceError& a, const SurfaceError& b) {
  EXPECT_EQ(a.sampled, b.sampled);
  EXPECT_EQ(a.nearest.rms, b.nearest.rms);
  EXPECT_EQ(a.splat.rms, b.splat.rms);
  EXPECT_EQ(a.splat.percentile_99, b.splat.percentile_99);
  EXPECT_EQ(a.uncovered, b.uncovered);
  EXPECT_EQ(a.overdraw, b.overdraw);
  EXPECT_EQ(a.factor_99_9, b.factor_99_9);
  EXPECT_EQ(a.factor_all, b.factor_all);
}

TEST_F(MeasuredGeometry, NeitherThreadsNorMemoryChangeABit) {
  const auto path = build(cloud(2000, true));
  for (const std::uint64_t sample : {std::uint64_t{700}, kAll}) {
    context().threads = 7;
    const ErrorReport wide = measure(path, {.sample = sample});
    context().threads = 1;
    context().memory_bytes = 1;
    const ErrorReport narrow = measure(path, {.sample = sample});
    context().memory_bytes = std::uint64_t{1} << 30;
    for (std::size_t i = 0; i < wide.levels.size(); ++i) {
      const auto &a = wide.levels[i].geometry, &b = narrow.levels[i].geometry;
      expect_equal(a.surface.value(), b.surface.value());
      EXPECT_EQ(a.spacing.value().mean, b.spacing.value().mean);
      EXPECT_EQ(a.spacing->variation, b.spacing->variation);
    }
  }
}

TEST_F(MeasuredGeometry, OfASampleTheRangesHoldTheFiguresOfAll) {
  const auto path = build(cloud(9000, false));
  const ErrorReport all = measure(path, {.sample = kAll});
  const ErrorReport some = measure(path, {.sample = 3000});
  for (std::size_t i = 0; i < all.levels.size(); ++i) {
    const SurfaceError &whole = all.levels[i].geometry.surface.value(),
                       &part = some.levels[i].geometry.surface.value();
    // Five standard deviations of the number that is taken.
    EXPECT_NEAR(static_cast<double>(part.sampled), 3000, 5 * std::sqrt(3000 * 2.0 / 3));
    const Interval rms = part.nearest.rms_interval.value();
    EXPECT_LE(rms.low, whole.nearest.rms);
    EXPECT_GE(rms.high, whole.nearest.rms);
    EXPECT_LT(rms.high - rms.low, 0.05 * whole.nearest.rms);
    EXPECT_LE(part.uncovered_interval.value().low, whole.uncovered);
    EXPECT_GE(part.uncovered_interval->high, whole.uncovered);
    EXPECT_LE(part.factor_all, whole.factor_all);
    EXPECT_FALSE(whole.uncovered_interval.has_value());
  }
}

TEST_F(MeasuredGeometry, NoneIsMeasuredOfNone) {
  const ErrorReport report = measure(build(cloud(1400, false)), {.sample = 0});
  EXPECT_FALSE(report.levels[0].geometry.surface || report.levels[0].geometry.spacing);
  EXPECT_GT(report.levels[0].rms, 0);
}

TEST_F(MeasuredGeometry, AgainstScansTheOrderOfBlocksIsForgotten) {
  const test::SmallBuild points = cloud(6000, false);
  const auto path = build(points);
  const GridPoint origin = origin_of(path);
  std::vector<GridPoint> queries = random_points(6000, 2000, 11);
  for (GridPoint& p : queries)
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += origin[axis];
  const auto run = [&](std::size_t block) {
    const RecordSource source = [&](const RecordSink& sink) {
      for (std::size_t first = 0; first < queries.size(); first += block)
        sink(std::as_bytes(
                 std::span(queries).subspan(first, std::min(block, queries.size() - first))),
             sizeof(GridPoint));
    };
    return measure(path, {.sample = 3000, .against = source});
  };
  const ErrorReport one = run(6000);
  std::ranges::reverse(queries);
  const ErrorReport many = run(17);
  EXPECT_NEAR(static_cast<double>(one.leaves.surface.value().sampled), 3000, 200);
  for (std::size_t i = 0; i < one.levels.size(); ++i)
    expect_equal(one.levels[i].geometry.surface.value(), many.levels[i].geometry.surface.value());
  expect_equal(*one.leaves.surface, many.leaves.surface.value());
}

TEST_F(MeasuredGeometry, AScansOwnPointsAreWhereTheLeavesHaveThem) {
  const test::SmallBuild points = cloud(3000, false);
  const auto path = build(points);
  const ErrorReport stored = measure(path, {.sample = kAll});
  std::vector<GridPoint> queries;
  const DatasetReader dataset = DatasetReader::open(path);
  for (std::uint64_t n = 0; n < dataset.tree().nodes_on(dataset.tree().leaf_level()); ++n) {
    const auto node = dataset.read_node(dataset.tree().id(dataset.tree().leaf_level(), n),
                                        formats::all_sections());
    queries.insert(queries.end(), node.position.begin(), node.position.end());
  }
  const ErrorReport scans = measure_queries(path, queries);
  EXPECT_EQ(scans.leaves.surface.value().nearest.largest, 0);
  for (std::size_t i = 0; i < stored.levels.size(); ++i) {
    const SurfaceError &a = scans.levels[i].geometry.surface.value(),
                       &b = stored.levels[i].geometry.surface.value();
    EXPECT_NEAR(a.nearest.rms, b.nearest.rms, 1e-9 * b.nearest.rms);
    EXPECT_EQ(a.overdraw, b.overdraw);
  }
}

TEST(ShareInterval, IsWilsons) {
  // Of R: prop.test(x, n, correct = FALSE)$conf.int.
  const Interval few = share_interval(1, 10);
  EXPECT_NEAR(few.low, 0.01787621, 1e-7);
  EXPECT_NEAR(few.high, 0.40415003, 1e-7);
  EXPECT_EQ(share_interval(0, 10).low, 0);
  EXPECT_NEAR(share_interval(0, 10).high, 0.27753279, 1e-7);
  EXPECT_EQ(share_interval(10, 10).high, 1);
}

TEST(DeviationInterval, IsThatOfTheMeanSquare) {
  Deviation deviation;
  for (const double square : {1.0, 2.0, 3.0, 4.0}) deviation.add(square);
  // The mean is 2.5, the sample's variance 5/3, the mean's standard error sqrt(5/12).
  const double half = 1.959963984540054 * std::sqrt(5.0 / 12);
  EXPECT_NEAR(deviation.rms_interval().low, std::sqrt(2.5 - half), 1e-12);
  EXPECT_NEAR(deviation.rms_interval().high, std::sqrt(2.5 + half), 1e-12);
  // In any unit: the squares of squares may be more, or less, than a double holds.
  for (const double unit : {1e100, 1e-100}) {
    Deviation scaled;
    for (const double square : {1.0, 2.0, 3.0, 4.0}) scaled.add(square * unit * unit);
    EXPECT_NEAR(scaled.rms_interval().low / unit, std::sqrt(2.5 - half), 1e-12);
    EXPECT_NEAR(scaled.rms_interval().high / unit, std::sqrt(2.5 + half), 1e-12);
  }
}

}  // namespace
}  // namespace cairn::stages
