#include "stages/estimate/estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "stages/import/import.h"
#include "stages/neighbors/neighborhoods.h"
#include "stages/parallel.h"
#include "stages/split/split.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::GridBox;
using formats::GridPoint;
using formats::Tree;
using Vec = std::array<double, 3>;

/// A record after the estimate of both.
struct Point {
  GridPoint position;
  std::uint32_t number;
  std::array<float, 3> normal;
  float radius;
  friend bool operator==(const Point&, const Point&) = default;
};
static_assert(sizeof(Point) == 32);

/// What a test's campaign is: scans of steps, their encoding, their sensors.
struct Campaign {
  std::vector<std::vector<GridPoint>> scans;
  Vec scale{1, 1, 1};
  Vec offset{0, 0, 0};
  std::vector<std::optional<Vec>> sensors = {};
};

std::vector<GridPoint> random_points(std::size_t count, std::uint32_t range, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<GridPoint> points(count);
  for (GridPoint& p : points)
    for (std::int32_t& c : p) c = static_cast<std::int32_t>(random() % range);
  return points;
}

/// A lattice of `side` x `side` points, `spacing` steps apart, at height z.
std::vector<GridPoint> lattice(std::int32_t side, std::int32_t spacing, std::int32_t z = 0) {
  std::vector<GridPoint> points;
  for (std::int32_t i = 0; i < side; ++i)
    for (std::int32_t j = 0; j < side; ++j) points.push_back({i * spacing, j * spacing, z});
  return points;
}

class EstimateTest : public test::StageFixture {
 protected:
  ImportedPoints import(const Campaign& campaign) {
    Scans scans;
    std::uint32_t number = 0;
    for (const auto& points : campaign.scans) {
      formats::PointBlock block;
      block.count = points.size();
      block.steps = points;
      block.columns.resize(1);
      for (std::size_t i = 0; i < points.size(); ++i, ++number) {
        const auto bytes = std::as_bytes(std::span(&number, 1));
        block.columns[0].insert(block.columns[0].end(), bytes.begin(), bytes.end());
      }
      scans.push_back(
          test::steps_scan({{"number", formats::ScalarType::kU32, 1, formats::ReduceRule::kNone}},
                           {block}, campaign.scale, campaign.offset));
    }
    return import_scans(scans, {.number_scans = scans.size() > 1}, context());
  }

  /// The estimated points in the order of their numbers. Their positions count from the cloud's least.
  std::vector<Point> run(const Campaign& campaign, std::uint64_t node_points,
                         std::uint32_t neighbors = 16) {
    ImportedPoints imported = import(campaign);
    const formats::Grid grid = imported.grid;
    const bool numbered = imported.numbered;
    const Tree tree(imported.points, 3, node_points);
    SplitPoints split_points = split(std::move(imported), tree, context());
    const EstimatedPoints result =
        estimate({split_points.array, split_points.stride, numbered, grid, tree, campaign.sensors},
                 {.normals = true, .radii = true, .neighbors = neighbors}, context());
    EXPECT_EQ(result.stride, sizeof(Point));
    std::vector<Point> points(tree.points());
    std::memcpy(points.data(), result.array.bytes().data(), points.size() * sizeof(Point));
    std::sort(points.begin(), points.end(),
              [](const Point& a, const Point& b) { return a.number < b.number; });
    return points;
  }
};

/// Distances by the plain formula; the neighbours of each distinct position by sorting all.
std::vector<Neighbor> brute_force(const std::vector<GridPoint>& distinct, const GridPoint& p,
                                  const Vec& step, std::size_t neighbors) {
  std::vector<Neighbor> all;
  for (const GridPoint& q : distinct) {
    const double x = step[0] * (p[0] - q[0]), y = step[1] * (p[1] - q[1]),
                 z = step[2] * (p[2] - q[2]);
    all.push_back({x * x + y * y + z * z, q});
  }
  std::sort(all.begin(), all.end());
  all.resize(std::min(all.size(), neighbors));
  return all;
}

TEST_F(EstimateTest, NeighborsAreThoseOfBruteForceAcrossLeaves) {
  for (const std::uint32_t range : {1U << 20, 12U})  // the latter: copies, and many equal distances
    for (const std::size_t neighbors : {3U, 16U, 200U}) {
      Campaign campaign{{random_points(1500, range, range)}, {0.5, 1, 0.25}};
      campaign.scans[0].push_back({1 << 24, 0, 0});  // strays: balls that reach over many leaves
      campaign.scans[0].push_back({1 << 24, 1 << 23, 0});
      campaign.scans[0].insert(campaign.scans[0].end(), 700,
                               {5, 5, 5});  // several leaves of one spot
      ImportedPoints imported = import(campaign);
      const Vec step = imported.grid.step;
      const Tree tree(imported.points, 3, 60);
      SplitPoints points = split(std::move(imported), tree, context());
      std::vector<GridBox> leaves(tree.nodes_on(tree.leaf_level()));
      std::vector<GridPoint> distinct;
      for (std::uint64_t leaf = 0; leaf < leaves.size(); ++leaf) {
        const auto range_of_leaf = tree.input_range(tree.leaf_level(), leaf);
        for (std::uint64_t i = range_of_leaf.first; i < range_of_leaf.end(); ++i) {
          GridPoint p;
          std::memcpy(p.data(), points.array.bytes().data() + i * points.stride, 12);
          leaves[leaf].add(p);
          distinct.push_back(p);
        }
      }
      std::sort(distinct.begin(), distinct.end());
      distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
      const LeafBoxes boxes(tree, step, leaves);
      const NeighborhoodFinder finder(points.array, points.stride, boxes, neighbors);
      for (std::uint64_t leaf = 0; leaf < leaves.size(); ++leaf) {
        const auto r = tree.input_range(tree.leaf_level(), leaf);
        const DistinctPositions own(
            points.array.bytes().subspan(r.first * points.stride, r.count * points.stride),
            points.stride, leaves[leaf]);
        std::size_t taken = 0;
        finder.find(leaf, own, [&](std::size_t i, std::span<const Neighbor> found) {
          const auto expected = brute_force(distinct, own.positions[i], step, neighbors);
          EXPECT_TRUE(std::ranges::equal(found, expected)) << range << " " << neighbors;
          ++taken;
        });
        EXPECT_EQ(taken, own.positions.size());
      }
    }
}

TEST(NearLeaves, LeavesOfOneRepeatedPositionAreFoundOnce) {
  const Tree tree(1000, 2, 10);
  std::vector<GridBox> leaves(tree.nodes_on(tree.leaf_level()), GridBox{{1, 2, 3}, {1, 2, 3}});
  const std::uint64_t last = leaves.size() - 1;
  leaves[last] = {{1, 2, 3}, {9, 9, 9}};
  const LeafBoxes boxes(tree, {1, 1, 1}, leaves);
  NearLeaves of_first(boxes, 0), of_other(boxes, 5);
  EXPECT_EQ(of_first.at(0)->leaf, last);
  EXPECT_EQ(of_first.at(1), nullptr);
  EXPECT_EQ(of_other.at(0)->leaf, 0U);
  EXPECT_EQ(of_other.at(1)->leaf, last);
  EXPECT_EQ(of_other.at(2), nullptr);
}

TEST_F(EstimateTest, DoesNotDependOnHowPointsAreDivided) {
  const Campaign campaign{{random_points(4000, 60, 2)}};
  const auto whole = run(campaign, 4000);
  EXPECT_EQ(run(campaign, 40), whole);
}

TEST_F(EstimateTest, PlanesHaveTheirNormals) {
  std::vector<GridPoint> slanted = lattice(40, 10);
  for (GridPoint& p : slanted) p[2] = p[0] + 2 * p[1];
  const double length = std::sqrt(6);
  for (const Point& p : run({{slanted}}, 100)) {
    EXPECT_NEAR(p.normal[0], -1 / length, 1e-6);
    EXPECT_NEAR(p.normal[1], -2 / length, 1e-6);
    EXPECT_NEAR(p.normal[2], 1 / length, 1e-6);
  }
  for (const Point& p : run({{lattice(40, 10)}}, 100))
    EXPECT_EQ(p.normal, (std::array<float, 3>{0, 0, 1}));
}

TEST_F(EstimateTest, ParallelSheetsDoNotDisturbEachOther) {
  std::vector<GridPoint> sheets = lattice(30, 10);
  const auto upper = lattice(30, 10, 1000);
  sheets.insert(sheets.end(), upper.begin(), upper.end());
  const auto both = run({{sheets}}, 100);
  const auto one = run({{lattice(30, 10)}}, 100);
  for (std::size_t i = 0; i < both.size(); ++i) {
    EXPECT_EQ(both[i].normal, (std::array<float, 3>{0, 0, 1}));
    EXPECT_EQ(both[i].radius, one[i % one.size()].radius);
  }
}

TEST_F(EstimateTest, SphereNormalsStayWithinTheNeighborhoodAndFaceTheSensor) {
  constexpr double kRadius = 1e6;
  constexpr int kCount = 20000;
  std::vector<GridPoint> sphere;
  for (int i = 0; i < kCount; ++i) {  // a Fibonacci lattice
    const double z = 1 - (2 * i + 1.0) / kCount, r = std::sqrt(1 - z * z),
                 turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    sphere.push_back({static_cast<std::int32_t>(std::lround(kRadius * (1 + r * std::cos(turn)))),
                      static_cast<std::int32_t>(std::lround(kRadius * (1 + r * std::sin(turn)))),
                      static_cast<std::int32_t>(std::lround(kRadius * (1 + z)))});
  }
  const Vec centre{kRadius, kRadius, kRadius};
  const auto points = run({{sphere}, {1, 1, 1}, {0, 0, 0}, {centre}}, 1000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double inward = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      inward +=
          static_cast<double>(points[i].normal[axis]) * (centre[axis] - sphere[i][axis]) / kRadius;
    // The chord to the last neighbour spans the cap's angle; a plane fitted to points of the cap tilts less.
    const double chord = static_cast<double>(points[i].radius) / std::sqrt(std::numbers::pi / 30);
    EXPECT_GT(inward, std::cos(2 * std::asin(chord / (2 * kRadius))));
  }
}

TEST_F(EstimateTest, EachPointFacesTheSensorOfItsOwnScan) {
  const Campaign campaign{{lattice(30, 10), lattice(30, 10)},
                          {0.001, 0.001, 0.001},
                          {500'000, 5'000'000, 100},
                          {Vec{500'000, 5'000'000, 105}, Vec{500'000, 5'000'000, 95}}};
  const auto points = run(campaign, 100);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(points[i].normal[2], i < points.size() / 2 ? 1 : -1);
}

TEST_F(EstimateTest, WithoutSensorNormalsFaceUpThenAlongXThenY) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<GridPoint> wall = lattice(20, 10);
    for (GridPoint& p : wall) std::swap(p[axis], p[2]);
    std::array<float, 3> expected{0, 0, 0};
    expected[axis] = 1;
    for (const Point& p : run({{wall}}, 60)) EXPECT_EQ(p.normal, expected);
    // A sensor inside the wall sees it edge-on.
    for (const Point& p : run({{wall}, {1, 1, 1}, {0, 0, 0}, {Vec{0, 0, 0}}}, 60))
      EXPECT_EQ(p.normal, expected);
  }
}

TEST_F(EstimateTest, RadiiCoverASquareLattice) {
  const auto points = run({{lattice(21, 10)}, {0.1, 0.1, 0.1}}, 50, 9);
  // The ninth position, the point's own included, lies across the diagonal of a square of side 1.
  const double expected = std::sqrt(2.0) * std::sqrt(std::numbers::pi / 16);
  for (const Point& p : points) {
    const bool inside =
        std::min(p.position[0], p.position[1]) > 0 && std::max(p.position[0], p.position[1]) < 200;
    if (inside) EXPECT_NEAR(p.radius, expected, 1e-6);
    if (!inside) EXPECT_GT(p.radius, expected);
  }
  // Wide neighbourhoods tend to half a square's diagonal.
  const auto wide = run({{lattice(41, 10)}, {0.1, 0.1, 0.1}}, 300, 300);
  EXPECT_NEAR(wide[20 * 41 + 20].radius, std::sqrt(0.5), 0.02);
}

TEST_F(EstimateTest, FarFromTheOriginNothingChanges) {
  const auto points = random_points(3000, 5000, 8);
  const auto near = run({{points}, {0.001, 0.001, 0.001}}, 200);
  const auto far = run({{points}, {0.001, 0.001, 0.001}, {500'000, 5'400'000, 250}}, 200);
  EXPECT_EQ(near, far);
}

TEST_F(EstimateTest, DegenerateCloudsHaveNoNormal) {
  const std::array<float, 3> none{0, 0, 0};
  for (const std::size_t count : {1U, 50'000U}) {  // one position
    const auto same = run({{std::vector<GridPoint>(count, {7, 7, 7})}, {1, 2, 0.5}}, 1000);
    ASSERT_EQ(same.size(), count);
    for (const Point& p : same) ASSERT_TRUE(p.normal == none && p.radius == 2);
  }
  std::vector<GridPoint> line;
  for (std::int32_t i = 0; i < 500; ++i) line.push_back({3 * i, -7 * i, 11 * i});
  for (const Point& p : run({{line}}, 40)) EXPECT_EQ(p.normal, none);
  for (const Point& p : run({{{{0, 0, 0}, {10, 0, 0}}}}, 40)) {
    EXPECT_EQ(p.normal, none);
    EXPECT_FLOAT_EQ(p.radius, static_cast<float>(10 * std::sqrt(std::numbers::pi / 2)));
  }
}

TEST_F(EstimateTest, FewerPointsThanNeighborsAreAllTheNeighbors) {
  const auto points = run({{lattice(3, 10)}}, 4, 1000);
  for (const Point& p : points) EXPECT_EQ(p.normal, (std::array<float, 3>{0, 0, 1}));
  // From a corner the other corner is the farthest of 8 others.
  EXPECT_FLOAT_EQ(points[0].radius,
                  static_cast<float>(std::sqrt(800.0) * std::sqrt(std::numbers::pi / 16)));
}

TEST_F(EstimateTest, SameBytesFromAnyThreadsAndWithTinyMemory) {
  const Campaign campaign{{random_points(30000, 300, 4), random_points(5000, 100, 5)},
                          {1, 1, 1},
                          {0, 0, 0},
                          {Vec{50, 50, 50}, std::nullopt}};
  const auto with = [&](unsigned threads, std::uint64_t memory) {
    context().threads = threads;
    context().memory_bytes = memory;
    return run(campaign, 500, 8);
  };
  const auto one = with(1, std::uint64_t{1} << 30);
  EXPECT_EQ(with(2, std::uint64_t{1} << 30), one);
  EXPECT_EQ(with(7, std::uint64_t{1} << 20), one);
}

}  // namespace
}  // namespace cairn::stages
