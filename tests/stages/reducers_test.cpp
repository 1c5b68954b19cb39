// What the reducers make of one node, against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "stages/cluster/center_tree.h"
#include "stages/cluster/cluster_reducer.h"
#include "stages/cluster/grid_reducer.h"
#include "stages/cluster/lloyd.h"
#include "stages/cluster/sampling_reducers.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;
using formats::Normal;

struct Cloud {
  formats::Grid grid;
  std::vector<GridPoint> position;
  std::vector<std::uint64_t> weight;
  std::vector<Normal> normal;
  std::vector<float> radius;
  CurveOrder curve;

  NodeView view() const {
    return {formats::NodeId{7}, grid, position, weight, normal, radius, curve};
  }
  Location place(std::size_t i) const {
    Location place;
    for (std::size_t axis = 0; axis < 3; ++axis) place[axis] = position[i][axis] * grid.step[axis];
    return place;
  }
};

/// Points of a wavy sheet, some of them twice, of weights 1 to 9.
Cloud sheet(std::size_t count, std::uint32_t seed, bool normals) {
  std::mt19937 random(seed);
  Cloud cloud;
  cloud.grid.step = {0.01, 0.02, 0.005};
  for (std::size_t i = 0; i < count; ++i) {
    const auto u = static_cast<std::int32_t>(random() % 4096),
               v = static_cast<std::int32_t>(random() % 2048);
    cloud.position.push_back(i % 50 == 1 ? cloud.position.back() : GridPoint{u, v, (u + v) % 700});
    cloud.weight.push_back(1 + random() % 9);
    const double angle = u * 0.002;
    if (normals)
      cloud.normal.push_back(
          {static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))});
    cloud.radius.push_back(0.1F);
  }
  cloud.curve = order_along_curve(cloud.grid, cloud.position, std::nullopt);
  return cloud;
}

/// side x side points a step apart.
Cloud lattice(std::int32_t side) {
  Cloud cloud;
  cloud.grid.step = {1, 1, 1};
  for (std::int32_t x = 0; x < side; ++x)
    for (std::int32_t y = 0; y < side; ++y) cloud.position.push_back({x, y, 0});
  cloud.radius.assign(cloud.position.size(), 1);
  cloud.curve = order_along_curve(cloud.grid, cloud.position, std::nullopt);
  return cloud;
}

double squared_error(const Cloud& cloud, const std::vector<std::uint32_t>& representative,
                     std::size_t quota) {
  std::vector<Location> center(quota);
  std::vector<double> weight(quota);
  for (std::size_t i = 0; i < representative.size(); ++i) {
    weight[representative[i]] += static_cast<double>(cloud.weight[i]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      center[representative[i]][axis] +=
          static_cast<double>(cloud.weight[i]) * cloud.place(i)[axis];
  }
  for (std::size_t r = 0; r < quota; ++r)
    for (double& coordinate : center[r]) coordinate /= weight[r];
  double sum = 0;
  for (std::size_t i = 0; i < representative.size(); ++i)
    sum += static_cast<double>(cloud.weight[i]) *
           squared_distance(cloud.place(i), center[representative[i]]);
  return sum;
}

/// Numbered by their first points along the curve, each with a point at least.
void expect_numbered(const Cloud& cloud, const Reduction& reduction, std::size_t quota) {
  std::uint32_t next = 0;
  for (const std::uint32_t i : cloud.curve.order) {
    ASSERT_LE(reduction.representative[i], next);
    next += reduction.representative[i] == next ? 1 : 0;
  }
  EXPECT_EQ(next, quota);
}

TEST(Reducers, NumberTheirRepresentativesAlongTheCurve) {
  for (const std::string_view name : reducer_names())
    for (const std::size_t quota : {1, 2, 77, 250, 1000}) {
      const Cloud cloud = sheet(1000, 5, quota % 2 == 0);
      const Reduction reduction = make_reducer(name, {})->reduce(cloud.view(), quota);
      expect_numbered(cloud, reduction, quota);
    }
}

TEST(CenterTree, FindsTheNearestOfAll) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (const std::size_t count : {1, 2, 8, 9, 17, 1000}) {
    std::vector<Location> centers;
    for (std::size_t i = 0; i < count; ++i)
      centers.push_back(
          i % 7 == 3 ? centers[i - 1]
                     : Location{anywhere(random), anywhere(random), 0.01 * anywhere(random)});
    const CenterTree tree(centers);
    for (int trial = 0; trial < 200; ++trial) {
      const Location place{anywhere(random), anywhere(random), anywhere(random)};
      double expected = INFINITY, found = INFINITY;
      for (const Location& center : centers)
        expected = std::min(expected, squared_distance(place, center));
      tree.search(place, found, [&](std::uint32_t index, double square) {
        EXPECT_EQ(square, squared_distance(place, centers[index]));
        return found = square;
      });
      EXPECT_EQ(found, expected);
    }
  }
}

TEST(CenterTree, CentersAtOnePlaceAreNotAllLookedAt) {
  std::vector<Location> centers(100'000, Location{1, 2, 3});
  for (int i = 0; i < 1000; ++i) centers.push_back({1 + 0.001 * i, 5, 6});
  const CenterTree tree(centers);
  for (const Location& place : {Location{1, 2, 3}, Location{1, 2.5, 3}, Location{0, 0, 0}}) {
    std::uint32_t visits = 0, nearest = 0;
    double limit = INFINITY;
    tree.search(place, limit, [&](std::uint32_t index, double square) {
      ++visits;
      nearest = index;
      return limit = square;
    });
    EXPECT_LT(nearest, 100'000U);
    EXPECT_LT(visits, 1000U);
  }
}

TEST(Lloyd, EveryPassLowersTheErrorAndKeepsAllClusters) {
  const Cloud cloud = sheet(4000, 1, false);
  std::vector<std::uint32_t> representative =
      ClusterReducer({.grid = {}, .theta = {}, .refinement = 0})
          .reduce(cloud.view(), 1000)
          .representative;
  double error = squared_error(cloud, representative, 1000);
  for (int pass = 0; pass < 5; ++pass) {
    lloyd_pass(cloud.view(), 15, 1000, representative);
    const double now = squared_error(cloud, representative, 1000);
    EXPECT_LT(now, error);
    error = now;
    EXPECT_EQ(std::set<std::uint32_t>(representative.begin(), representative.end()).size(), 1000U);
  }
}

TEST(Lloyd, MovesPointsToTheNearestCenterThatFacesTheirWay) {
  const Cloud cloud = sheet(1500, 2, true);
  const std::size_t quota = 300;
  const float theta = 20;
  const std::vector<std::uint32_t> before =
      ClusterReducer({.grid = {}, .theta = {}, .refinement = 0})
          .reduce(cloud.view(), quota)
          .representative;
  std::vector<std::uint32_t> after = before;
  lloyd_pass(cloud.view(), theta, quota, after);

  std::vector<Location> center(quota), facing(quota);
  std::vector<double> weight(quota);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto w = static_cast<double>(cloud.weight[i]);
    weight[before[i]] += w;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      center[before[i]][axis] += w * cloud.place(i)[axis];
      facing[before[i]][axis] += w * double{cloud.normal[i][axis]};
    }
  }
  for (std::size_t r = 0; r < quota; ++r) {
    const double length = std::sqrt(squared_distance(facing[r], {}));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      center[r][axis] /= weight[r];
      facing[r][axis] /= length;
    }
  }
  const auto cosine = [&](std::size_t i, std::size_t r) {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      sum += double{cloud.normal[i][axis]} * facing[r][axis];
    return sum;
  };
  std::vector<double> nearest_kept(quota, INFINITY);
  for (std::size_t i = 0; i < before.size(); ++i)
    nearest_kept[before[i]] =
        std::min(nearest_kept[before[i]], squared_distance(cloud.place(i), center[before[i]]));
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double own = squared_distance(cloud.place(i), center[before[i]]);
    const double least = std::min(std::cos(theta * std::numbers::pi / 180), cosine(i, before[i]));
    double expected = own;
    for (std::size_t r = 0; r < quota; ++r)
      if (cosine(i, r) >= least + 1e-6)
        expected = std::min(expected, squared_distance(cloud.place(i), center[r]));
    if (own <= nearest_kept[before[i]] * (1 + 1e-9)) continue;  // those that may have to stay
    EXPECT_NEAR(squared_distance(cloud.place(i), center[after[i]]), expected, 1e-9);
    moved += before[i] != after[i] ? 1 : 0;
  }
  EXPECT_GT(moved, 20U);
}

TEST(SamplingReducer, KeepsPointsThatStandForThoseNearestToThem) {
  const Cloud cloud = sheet(1200, 4, false);
  for (const auto pick : {SamplingReducer::Pick::kFirst, SamplingReducer::Pick::kRandom}) {
    const Reduction reduction = SamplingReducer(pick).reduce(cloud.view(), 300);
    ASSERT_EQ(reduction.chosen.size(), 300U);
    for (std::size_t r = 0; r < 300; ++r)
      EXPECT_EQ(reduction.representative[reduction.chosen[r]], r);
    for (std::size_t i = 0; i < cloud.position.size(); ++i) {
      double nearest = INFINITY;
      for (const std::uint32_t chosen : reduction.chosen)
        nearest = std::min(nearest, squared_distance(cloud.place(i), cloud.place(chosen)));
      EXPECT_NEAR(squared_distance(cloud.place(i),
                                   cloud.place(reduction.chosen[reduction.representative[i]])),
                  nearest, 1e-12);
    }
  }
}

TEST(SamplingReducer, RandomTakesEveryPointWithTheSameChance) {
  Cloud cloud = sheet(400, 6, false);
  std::vector<int> taken(400);
  for (std::uint64_t node = 0; node < 400; ++node) {
    NodeView view = cloud.view();
    view.id = formats::NodeId{node};
    for (const std::uint32_t i :
         SamplingReducer(SamplingReducer::Pick::kRandom).reduce(view, 100).chosen)
      ++taken[i];
  }
  // Binomial(400, 1/4): mean 100, variance 75. The sum of squared deviations over the variance has about 400 degrees of
  // freedom: 500 is beyond three and a half standard deviations (sqrt 800).
  double chi_squared = 0;
  for (const int n : taken) chi_squared += (n - 100.0) * (n - 100.0) / 75;
  EXPECT_LT(chi_squared, 500);
  EXPECT_GT(chi_squared, 300);
}

TEST(GridReducer, CellsAreThoseOfARegularGrid) {
  // 8 x 8 x 1 cells of 3 x 3 points each.
  const Cloud cloud = lattice(24);
  const Reduction reduction = GridReducer(GridReducer::Filter::kCell).reduce(cloud.view(), 64);
  std::map<std::uint32_t, std::pair<int, int>> cell_of;
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    const std::pair<int, int> cell{cloud.position[i][0] / 3, cloud.position[i][1] / 3};
    const auto known = cell_of.emplace(reduction.representative[i], cell).first;
    EXPECT_EQ(known->second, cell);
  }
  EXPECT_EQ(cell_of.size(), 64U);
}

TEST(GridReducer, SharesFallWithTheDistanceFromTheCellsCenter) {
  const Cloud cloud = lattice(40);
  const Reduction reduction = GridReducer(GridReducer::Filter::kReach).reduce(cloud.view(), 100);
  ASSERT_EQ(reduction.blend.size(), 100U);
  // The narrowest cells of which ten hold places from 0 to 39 are a hair wider than 3.9; all places lie at their bottom.
  const double width = 3.9;
  for (std::uint32_t r = 0; r < 100; ++r) {
    double x = 0, y = 0, own = 0;
    for (std::size_t i = 0; i < cloud.position.size(); ++i) {
      if (reduction.representative[i] != r) continue;
      x += cloud.position[i][0];
      y += cloud.position[i][1];
      ++own;
    }
    const Location center{(std::floor(x / own / width) + 0.5) * width,
                          (std::floor(y / own / width) + 0.5) * width, 0.5 * width};
    std::map<std::uint32_t, double> factor_of;
    for (const auto& [point, factor] : reduction.blend[r])
      EXPECT_TRUE(factor_of.emplace(point, factor).second);
    for (std::uint32_t i = 0; i < cloud.position.size(); ++i) {
      const double expected =
          std::max(0.0, 1 - std::sqrt(squared_distance(cloud.place(i), center)) / width);
      EXPECT_NEAR(factor_of.contains(i) ? factor_of[i] : 0, expected, 1e-4);
    }
  }
}

}  // namespace
}  // namespace cairn::stages
