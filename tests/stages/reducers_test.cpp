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
#include "stages/cluster/normals.h"
#include "stages/cluster/places.h"
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

/// Anywhere in a flat box, some twice, along x.
CurvePoints flat_points(std::mt19937& random, std::size_t count, bool normals) {
  std::uniform_real_distribution<double> anywhere(-100, 100);
  std::vector<Location> places;
  for (std::size_t i = 0; i < count; ++i)
    places.push_back(i % 7 == 3
                         ? places[i - 1]
                         : Location{anywhere(random), anywhere(random), 0.01 * anywhere(random)});
  std::ranges::sort(places);
  CurvePoints points;
  for (const auto& [x, y, z] : places) {
    points.x.push_back(x);
    points.y.push_back(y);
    points.z.push_back(z);
    if (!normals) continue;
    const double angle = 0.05 * y;
    points.nx.push_back(static_cast<float>(std::sin(angle)));
    points.ny.push_back(0);
    points.nz.push_back(static_cast<float>(std::cos(angle)));
    if (random() % 10 == 0) points.nx.back() = points.nz.back() = 0;  // none
  }
  return points;
}

Location place_of(const CurvePoints& points, std::size_t i) {
  return {points.x[i], points.y[i], points.z[i]};
}

TEST(CenterTree, MovesPointsToTheNearestOfAll) {
  std::mt19937 random(3);
  for (const bool normals : {false, true})
    for (const std::size_t count : {1, 2, 15, 16, 17, 300, 5000}) {
      const CurvePoints centers = flat_points(random, count, normals);
      const CurvePoints points = flat_points(random, 1001, normals);
      std::vector<std::uint32_t> before;
      for (std::size_t i = 0; i < points.count(); ++i)
        before.push_back(static_cast<std::uint32_t>(i * count / points.count()));
      std::vector<std::uint32_t> after = before;
      const float min_cosine = 0.95F;
      CenterTree(centers).move_to_nearest(points, min_cosine, after);
      for (std::size_t i = 0; i < points.count(); ++i) {
        const auto cosine = [&](std::size_t r) {
          return agreement(points.normal_of(i), centers.normal_of(r));
        };
        const float least = std::min(min_cosine, cosine(before[i]));
        double expected = squared_distance(place_of(points, i), place_of(centers, before[i]));
        for (std::size_t r = 0; r < count; ++r)
          if (cosine(r) >= least + 1e-6F)
            expected =
                std::min(expected, squared_distance(place_of(points, i), place_of(centers, r)));
        const double found = squared_distance(place_of(points, i), place_of(centers, after[i]));
        EXPECT_LE(found, expected * (1 + 1e-5)) << count;
        EXPECT_TRUE(after[i] == before[i] || cosine(after[i]) >= least - 1e-6F);
      }
    }
}

TEST(CenterTree, ManyCentersAtOnePlaceAndPointsFarFromTheirs) {
  // All but the last center stand at one place; the points, all over the place, begin with the last.
  std::mt19937 random(4);
  CurvePoints centers;
  for (std::vector<double>* column : {&centers.x, &centers.y, &centers.z})
    column->assign(100'000, 1.0);
  centers.x.back() = centers.y.back() = 1e5;
  const CurvePoints points = flat_points(random, 2000, false);
  std::vector<std::uint32_t> center_of(points.count(), 99'999);
  CenterTree(centers).move_to_nearest(points, -1, center_of);
  for (const std::uint32_t center : center_of) EXPECT_LT(center, 99'999U);
}

/// lloyd_pass with clusters for each point, not along the curve.
std::vector<std::uint32_t> after_pass(const Cloud& cloud, float theta, std::uint64_t quota,
                                      const std::vector<std::uint32_t>& cluster_of) {
  std::vector<std::uint32_t> along_curve;
  for (const std::uint32_t point : cloud.curve.order) along_curve.push_back(cluster_of[point]);
  lloyd_pass(points_along_curve(cloud.view()), theta, quota, along_curve);
  return by_point(cloud.curve, along_curve);
}

TEST(Lloyd, EveryPassLowersTheErrorAndKeepsAllClusters) {
  const Cloud cloud = sheet(4000, 1, false);
  std::vector<std::uint32_t> representative =
      ClusterReducer({.grid = {}, .theta = {}, .refinement = 0})
          .reduce(cloud.view(), 1000)
          .representative;
  double error = squared_error(cloud, representative, 1000);
  for (int pass = 0; pass < 5; ++pass) {
    representative = after_pass(cloud, 15, 1000, representative);
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
  const std::vector<std::uint32_t> after = after_pass(cloud, theta, quota, before);

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
    EXPECT_NEAR(squared_distance(cloud.place(i), center[after[i]]), expected, 1e-5 * expected);
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
                  nearest, 1e-5 * nearest);
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
