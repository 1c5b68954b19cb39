#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "formats/scalar_value.h"
#include "stages/measure/deviation.h"
#include "stages/measure/measure.h"
#include "tests/support/small_build.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::GridPoint;
using formats::Level;
using formats::NodeId;

constexpr std::uint64_t kAll = MeasureOptions::kAllPoints;

class MeasuredGeometry : public test::StageFixture {
 protected:
  std::filesystem::path build(const test::SmallBuild& build) {
    const std::filesystem::path path = folder() / ("dataset" + std::to_string(next_++));
    test::write_built(build, path, context());
    return path;
  }
  ErrorReport measure(const std::filesystem::path& path, const MeasureOptions& options) {
    return measure_dataset(context(), DatasetReader::open(path), options);
  }
  /// Of queries that are grid points of the dataset.
  ErrorReport measure_queries(const std::filesystem::path& path,
                              const std::vector<GridPoint>& queries) {
    const RecordSource source = [&](const RecordSink& sink) {
      sink(std::as_bytes(std::span(queries)), sizeof(GridPoint));
    };
    return measure(path, {.sample = kAll, .against = source});
  }

 private:
  int next_ = 0;
};

std::vector<GridPoint> random_points(std::size_t count, std::uint32_t range, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<GridPoint> points(count);
  for (GridPoint& p : points)
    for (std::int32_t& c : p) c = static_cast<std::int32_t>(random() % range);
  return points;
}

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

test::SmallBuild cloud(std::size_t points, bool normals) {
  test::SmallBuild cloud{.points = random_points(points, 2000, 5),
                         .scale = {0.5, 0.25, 1},
                         .offset = {500'000, 5'000'000, 0},
                         .fanout = 3,
                         .node_points = 150};
  std::mt19937 random(6);
  std::uniform_real_distribution<float> component(-1, 1);
  for (std::size_t i = 0; normals && i < points; ++i)
    cloud.normals.push_back(i % 7 == 0 ? std::array<float, 3>{}
                                       : std::array{component(random), component(random), 1.0F});
  return cloud;
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

/// Where the first point of the lattice lies on the dataset's grid.
GridPoint origin_of(const std::filesystem::path& path) {
  const DatasetReader dataset = DatasetReader::open(path);
  return dataset.record(NodeId{0}).box.min;
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

class LongMeasuredPlane : public MeasuredGeometry {
 protected:
  OverLimit measure_plane(const std::string& reducer) {
    constexpr std::size_t kPoints = std::size_t{1} << 20;
    constexpr double kSide = 2e7, kScale = 1e-4;
    const auto path = build({.points = tilted_plane(kPoints, kSide, 3),
                             .scale = {kScale, kScale, kScale},
                             .offset = {5e5, 5e6, 300},
                             .node_points = kPoints / 64,
                             .reducer = reducer});
    const ErrorReport report = measure(path, {.sample = 100'000});
    EXPECT_EQ(report.levels.size(), 3U);
    const LevelError& root = report.levels.front();
    EXPECT_EQ(root.points, kPoints / 64);
    const double area = kSide * kScale * kSide * kScale;
    const double limit =
        std::sqrt(5 / (18 * std::numbers::sqrt3) * area / static_cast<double>(root.points));
    RecordProperty(reducer + "_assigned", std::to_string(root.rms / limit));
    RecordProperty(reducer + "_nearest",
                   std::to_string(root.geometry.surface.value().nearest.rms / limit));
    return {root.rms / limit, root.geometry.surface.value().nearest.rms / limit};
  }
};

TEST_F(LongMeasuredPlane, ClustersComeNearTheHexagonalLimit) {
  const OverLimit cluster = measure_plane("cluster");
  EXPECT_GE(cluster.nearest, 1);
  EXPECT_GE(cluster.assigned, cluster.nearest);
  EXPECT_LE(cluster.assigned, 1.10);
  EXPECT_LE(cluster.nearest, 1.06);
  const OverLimit random = measure_plane("random");
  EXPECT_NEAR(random.nearest, kRandomOverLimit, 0.01);
  for (const char* reducer : {"average", "first"}) {
    const OverLimit other = measure_plane(reducer);
    EXPECT_GT(other.nearest, cluster.nearest) << reducer;
    EXPECT_GT(other.assigned, cluster.assigned) << reducer;
    EXPECT_LT(other.nearest, random.nearest) << reducer;
  }
}

// --- Samples --------------------------------------------------------------------------------------

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
}

}  // namespace
}  // namespace cairn::stages
