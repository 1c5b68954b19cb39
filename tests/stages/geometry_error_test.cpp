#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "formats/scalar_value.h"
#include "tests/support/measured_geometry.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::GridPoint;
using formats::Level;
using test::cloud;
using test::MeasuredGeometry;
using test::origin_of;
using test::random_points;

constexpr std::uint64_t kAll = MeasureOptions::kAllPoints;

std::vector<GridPoint> lattice(std::int32_t side, std::int32_t steps, GridPoint first = {}) {
  std::vector<GridPoint> points;
  for (std::int32_t x = 0; x < side; ++x)
    for (std::int32_t y = 0; y < side; ++y)
      points.push_back({first[0] + x * steps, first[1] + y * steps, first[2]});
  return points;
}

// --- By looking at every pair ---------------------------------------------------------------------

using Real = long double;

struct PlainSplat {
  std::array<Real, 3> at;
  std::array<Real, 3> normal{};
  Real radius;
};

std::array<Real, 3> place(const formats::Grid& grid, const GridPoint& p) {
  return {Real{grid.step[0]} * p[0], Real{grid.step[1]} * p[1], Real{grid.step[2]} * p[2]};
}

std::vector<PlainSplat> splats_of(const DatasetReader& dataset, Level level) {
  std::vector<PlainSplat> splats;
  const auto normal = formats::find_attribute(dataset.header().schema, "normal");
  for (std::uint64_t n = 0; n < dataset.tree().nodes_on(level); ++n) {
    const auto points = dataset.read_node(dataset.tree().id(level, n), formats::all_sections());
    for (std::size_t i = 0; i < points.count(); ++i) {
      PlainSplat& splat = splats.emplace_back();
      splat.at = place(dataset.header().grid, points.position[i]);
      splat.radius = Real{points.radius[i]};
      for (std::size_t k = 0; normal && k < 3; ++k)
        splat.normal[k] = Real{formats::load_scalar(
            points.attributes[*normal].data() + 4 * (3 * i + k), formats::ScalarType::kF32)};
    }
  }
  return splats;
}

Real distance(const std::array<Real, 3>& a, const std::array<Real, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// From the disc's points, by its axis and the direction across.
Real splat_distance(const PlainSplat& splat, const std::array<Real, 3>& p) {
  const Real length = distance(splat.normal, {});
  if (length == 0) return std::max(Real{0}, distance(splat.at, p) - splat.radius);
  Real height = 0;
  for (std::size_t k = 0; k < 3; ++k) height += (p[k] - splat.at[k]) * splat.normal[k] / length;
  std::array<Real, 3> foot;
  for (std::size_t k = 0; k < 3; ++k) foot[k] = p[k] - height * splat.normal[k] / length;
  const Real aside = distance(foot, splat.at);
  if (aside <= splat.radius) return std::fabs(height);
  std::array<Real, 3> rim;
  for (std::size_t k = 0; k < 3; ++k)
    rim[k] = splat.at[k] + (foot[k] - splat.at[k]) * splat.radius / aside;
  return distance(rim, p);
}

struct BruteForce {
  std::vector<Real> nearest, splat, need, spacing;
  std::uint64_t covering = 0, uncovered = 0;

  BruteForce(const std::vector<PlainSplat>& splats, const std::vector<PlainSplat>& points) {
    for (const PlainSplat& point : points) add(splats, point.at);
    for (const PlainSplat& one : splats) {
      Real least = INFINITY;
      for (const PlainSplat& other : splats)
        if (const Real d = distance(one.at, other.at); d > 0) least = std::min(least, d);
      if (std::isfinite(least)) spacing.push_back(least);
    }
  }

 private:
  void add(const std::vector<PlainSplat>& splats, const std::array<Real, 3>& p) {
    std::vector<std::pair<Real, const PlainSplat*>> ranked;
    Real least_need = INFINITY;
    std::uint64_t covers = 0;
    for (const PlainSplat& one : splats) {
      const Real d = distance(one.at, p);
      ranked.emplace_back(d, &one);
      if (d <= one.radius) ++covers;
      if (one.radius > 0 || d == 0)
        least_need = std::min(least_need, d == 0 ? Real{0} : d / one.radius);
    }
    std::ranges::partial_sort(ranked, ranked.begin() + 8);
    Real least = INFINITY;
    for (std::size_t i = 0; i < 8; ++i)
      least = std::min(least, splat_distance(*ranked[i].second, p));
    nearest.push_back(ranked[0].first);
    splat.push_back(least);
    need.push_back(least_need);
    covering += covers;
    uncovered += covers == 0 ? 1 : 0;
  }
};

double rms_of(const std::vector<Real>& values) {
  Real sum = 0;
  for (const Real v : values) sum += v * v;
  return static_cast<double>(std::sqrt(sum / static_cast<Real>(values.size())));
}

double ranked(std::vector<Real> values, double share) {
  std::ranges::sort(values);
  const auto rank = std::ceil(share * static_cast<double>(values.size()));
  return static_cast<double>(values[static_cast<std::size_t>(rank) - 1]);
}

/// Up to the width of a histogram's bin above.
void expect_ranked(double found, const std::vector<Real>& values, double share) {
  const double exact = ranked(values, share);
  EXPECT_GE(found, exact * (1 - 1e-9));
  EXPECT_LE(found, exact * 1.002);
}

void expect_distances(const DistanceError& found, const std::vector<Real>& values) {
  EXPECT_NEAR(found.rms, rms_of(values), 1e-6 * rms_of(values));
  EXPECT_NEAR(found.largest, ranked(values, 1), 1e-6 * ranked(values, 1));
  expect_ranked(found.percentile_99, values, 0.99);
  EXPECT_FALSE(found.rms_interval.has_value());
}

void expect_brute_force(const ErrorReport& report, const DatasetReader& dataset) {
  const auto points = splats_of(dataset, dataset.tree().leaf_level());
  ASSERT_GE(report.levels.size(), 2U);
  for (const LevelError& level : report.levels) {
    const BruteForce brute(splats_of(dataset, level.level), points);
    ASSERT_TRUE(level.geometry.surface && level.geometry.spacing);
    const SurfaceError& surface = *level.geometry.surface;
    EXPECT_EQ(surface.sampled, points.size());
    expect_distances(surface.nearest, brute.nearest);
    EXPECT_LE(surface.nearest.rms, level.rms);
    expect_distances(surface.splat, brute.splat);
    const auto count = static_cast<double>(points.size());
    EXPECT_EQ(surface.uncovered, static_cast<double>(brute.uncovered) / count);
    EXPECT_EQ(surface.overdraw, static_cast<double>(brute.covering) / count);
    expect_ranked(surface.factor_99_9, brute.need, 0.999);
    EXPECT_NEAR(surface.factor_all, ranked(brute.need, 1), 1e-9 * surface.factor_all);
    Real mean = 0, square = 0;
    for (const Real d : brute.spacing) mean += d / static_cast<Real>(brute.spacing.size());
    for (const Real d : brute.spacing) square += (d - mean) * (d - mean);
    const Real deviation = std::sqrt(square / static_cast<Real>(brute.spacing.size()));
    EXPECT_EQ(level.geometry.spacing->sampled, brute.spacing.size());
    EXPECT_NEAR(level.geometry.spacing->mean, static_cast<double>(mean),
                1e-9 * level.geometry.spacing->mean);
    EXPECT_NEAR(level.geometry.spacing->variation, static_cast<double>(deviation / mean), 1e-9);
  }
}

TEST_F(MeasuredGeometry, IsWhatLookingAtEveryPairFinds) {
  for (const bool normals : {false, true}) {
    const auto path = build(cloud(1400, normals));
    expect_brute_force(measure(path, {.sample = kAll}), DatasetReader::open(path));
  }
}

TEST_F(MeasuredGeometry, RadiiOfManySizesAreSearchedAsFarAsTheyReach) {
  test::SmallBuild sizes = cloud(1400, false);
  std::mt19937 random(7);
  for (std::size_t i = 0; i < sizes.points.size(); ++i)
    sizes.radii.push_back(std::exp2(static_cast<float>(random() % 1000) / 100 - 2));
  sizes.radii[3] = 0;
  const auto path = build(sizes);
  expect_brute_force(measure(path, {.sample = kAll}), DatasetReader::open(path));
}

// --- Closed forms ---------------------------------------------------------------------------------

/// A lattice whose points are a unit and 16 steps apart, with discs or balls of radius 1/2.
test::SmallBuild unit_lattice(bool normals) {
  test::SmallBuild build{.points = lattice(48, 16),
                         .scale = {1.0 / 16, 1.0 / 16, 1.0 / 16},
                         .offset = {4e6, -5e6, 300},
                         .node_points = 200};
  build.radii.assign(build.points.size(), 0.5F);
  if (normals) build.normals.assign(build.points.size(), {0, 0, 1});
  return build;
}

TEST_F(MeasuredGeometry, BetweenFourPointsOfALattice) {
  for (const bool normals : {false, true}) {
    const auto path = build(unit_lattice(normals));
    const GridPoint origin = origin_of(path);
    ASSERT_EQ(DatasetReader::open(path).header().grid.step[0], 1.0 / 16);
    const auto report =
        measure_queries(path, lattice(47, 16, {origin[0] + 8, origin[1] + 8, origin[2] + 4}));
    const SurfaceError& leaves = report.leaves.surface.value();
    const double center = std::sqrt(0.5), away = std::sqrt(0.5 + 1.0 / 16);
    EXPECT_NEAR(leaves.nearest.rms, away, 1e-12);
    EXPECT_NEAR(leaves.nearest.largest, away, 1e-12);
    EXPECT_NEAR(leaves.splat.rms, normals ? std::hypot(center - 0.5, 0.25) : away - 0.5, 1e-12);
    EXPECT_EQ(leaves.uncovered, 1);
    EXPECT_EQ(leaves.overdraw, 0);
    EXPECT_NEAR(leaves.factor_all, away / 0.5, 1e-12);
    EXPECT_NEAR(leaves.factor_99_9, away / 0.5, 1e-12);
  }
}

TEST_F(MeasuredGeometry, WhereTwoSplatsTouch) {
  const auto path = build(unit_lattice(false));
  GridPoint first = origin_of(path);
  first[0] += 8;
  const SurfaceError leaves = measure_queries(path, lattice(47, 16, first)).leaves.surface.value();
  EXPECT_EQ(leaves.uncovered, 0);
  EXPECT_EQ(leaves.overdraw, 2);
  EXPECT_EQ(leaves.factor_all, 1);
  EXPECT_EQ(leaves.splat.rms, 0);
}

TEST_F(MeasuredGeometry, OneOfAThousandIsNotNeededForAFactorOf99_9Percent) {
  const auto path = build(unit_lattice(false));
  const GridPoint origin = origin_of(path);
  std::vector<GridPoint> queries(2302, {origin[0] + 4, origin[1], origin[2]});
  queries.resize(2304, {origin[0], origin[1], origin[2] + 32});
  const SurfaceError leaves = measure_queries(path, queries).leaves.surface.value();
  EXPECT_EQ(leaves.sampled, 2304U);
  EXPECT_NEAR(leaves.factor_99_9, 0.5, 0.001);
  EXPECT_EQ(leaves.factor_all, 4);
  EXPECT_EQ(leaves.uncovered, 2.0 / 2304);
}

TEST_F(MeasuredGeometry, SplatsWithoutExtentCoverAtNoFactor) {
  test::SmallBuild points = unit_lattice(false);
  points.radii.assign(points.points.size(), 0);
  const auto path = build(points);
  const GridPoint origin = origin_of(path);
  const SurfaceError leaves =
      measure_queries(path, {origin, {origin[0] + 1, origin[1], origin[2]}}).leaves.surface.value();
  EXPECT_EQ(leaves.uncovered, 0.5);
  EXPECT_EQ(leaves.overdraw, 0.5);
  EXPECT_TRUE(std::isinf(leaves.factor_all));
  EXPECT_TRUE(std::isinf(leaves.factor_99_9));
  const SurfaceError one =
      measure_queries(path, {{origin[0] + 1, origin[1], origin[2]}}).leaves.surface.value();
  EXPECT_TRUE(std::isinf(one.factor_all));
  EXPECT_TRUE(std::isinf(one.factor_99_9));
}

TEST_F(MeasuredGeometry, SpacingOfALatticeDoesNotVary) {
  const SpacingError spacing =
      measure(build(unit_lattice(false)), {.sample = kAll}).leaves.spacing.value();
  EXPECT_EQ(spacing.sampled, 48U * 48);
  EXPECT_EQ(spacing.mean, 1);
  EXPECT_EQ(spacing.variation, 0);
}

TEST_F(MeasuredGeometry, SpacingAtRandomInAPlaneIsPoissons) {
  constexpr std::int32_t kSide = 1'000'000;
  test::SmallBuild plane{.points = random_points(40'000, kSide, 9), .node_points = 5000};
  for (GridPoint& p : plane.points) p[2] = 0;
  const SpacingError spacing = measure(build(plane), {.sample = kAll}).leaves.spacing.value();
  // Of density m: mean 1 / (2 sqrt(m)), deviation sqrt((4 - pi) / (4 pi m)); the borders make it a little more.
  EXPECT_NEAR(spacing.mean / (0.5 * kSide / std::sqrt(40'000)), 1, 0.01);
  EXPECT_NEAR(spacing.variation, std::sqrt(4 / std::numbers::pi - 1), 0.01);
}

TEST_F(MeasuredGeometry, PointsAtOnePlaceHaveNoSpacing) {
  const test::SmallBuild same{.points = std::vector<GridPoint>(1000, {5, 6, 7}), .node_points = 60};
  const ErrorReport report = measure(build(same), {.sample = kAll});
  for (const LevelError& level : report.levels) {
    EXPECT_FALSE(level.geometry.spacing.has_value());
    EXPECT_EQ(level.geometry.surface.value().nearest.largest, 0);
    EXPECT_EQ(level.geometry.surface->uncovered, 0);
    EXPECT_EQ(level.geometry.surface->overdraw, static_cast<double>(level.points));
    EXPECT_EQ(level.geometry.surface->factor_all, 0);
  }
}

std::vector<GridPoint> at_random(std::size_t count, std::int32_t side, GridPoint first,
                                 unsigned seed) {
  std::vector<GridPoint> points = random_points(count, static_cast<std::uint32_t>(side), seed);
  for (GridPoint& p : points) p = {first[0] + p[0], first[1] + p[1], first[2]};
  return points;
}

TEST_F(MeasuredGeometry, FromALatticeARandomPlaceIsASixthOfItsCellAway) {
  test::SmallBuild points{.points = lattice(40, 10'000), .node_points = 400};
  const auto path = build(points);
  const SurfaceError leaves =
      measure_queries(path, at_random(1600, 39 * 10'000, origin_of(path), 4))
          .leaves.surface.value();
  // Mean square of a square cell: 1/6; its standard deviation is sqrt(1/90), and 1,600 were taken.
  const double mean_square = std::pow(leaves.nearest.rms / 10'000, 2);
  EXPECT_NEAR(mean_square, 1.0 / 6, 4 * std::sqrt(1.0 / 90 / 1600));
  EXPECT_LE(leaves.nearest.largest, 10'000 * std::sqrt(0.5));
}
}  // namespace
}  // namespace cairn::stages
