// Normals of neighbourhoods against Eigen's iterative solver, and of whole clouds against PCL's own estimate.
#include "stages/estimate/surface.h"

#include <gtest/gtest.h>
#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <random>

#include "stages/estimate/estimate.h"
#include "stages/import/import.h"
#include "stages/split/split.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;

/// Degrees between the lines of two vectors; of unit length both.
template <typename A, typename B>
double angle_between(const A& a, const B& b) {
  const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2],
               z = a[0] * b[1] - a[1] * b[0];
  return std::asin(std::min(1.0, std::hypot(x, y, z))) * 180 / std::numbers::pi;
}

/// Some positions around the first one: spread by so much along three random axes.
std::vector<Neighbor> neighborhood(const std::array<double, 3>& spread, std::size_t count,
                                   std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
          .normalized()
          .toRotationMatrix();
  std::vector<Neighbor> neighbors(count);
  for (Neighbor& neighbor : neighbors) {
    const Eigen::Vector3d p =
        axes * Eigen::Vector3d(spread[0] * normal(random), spread[1] * normal(random),
                               spread[2] * normal(random));
    for (int axis = 0; axis < 3; ++axis)
      neighbor.position[axis] = 1'000'000 + static_cast<std::int32_t>(std::lround(p[axis]));
  }
  for (Neighbor& neighbor : neighbors)
    for (int axis = 0; axis < 3; ++axis)
      neighbor.squared_distance +=
          std::pow(neighbor.position[axis] - neighbors.front().position[axis], 2);
  std::sort(neighbors.begin(), neighbors.end());
  return neighbors;
}

/// The direction of least variation, by two passes over long doubles and Eigen's QL iteration.
Eigen::Vector3d least_direction(const std::vector<Neighbor>& neighbors) {
  using Vector = Eigen::Matrix<long double, 3, 1>;
  const auto at = [](const Neighbor& n) {
    return Vector(n.position[0], n.position[1], n.position[2]);
  };
  Vector mean = Vector::Zero();
  for (const Neighbor& n : neighbors) mean += at(n);
  mean /= neighbors.size();
  Eigen::Matrix<long double, 3, 3> covariance = Eigen::Matrix<long double, 3, 3>::Zero();
  for (const Neighbor& n : neighbors) covariance += (at(n) - mean) * (at(n) - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<decltype(covariance)>(covariance)
      .eigenvectors()
      .col(0)
      .cast<double>();
}

TEST(PlaneNormal, IsTheDirectionOfLeastVariation) {
  const formats::Grid grid{.step = {1, 1, 1}};
  std::mt19937 random(3);
  // Thick, as measured, thin, and nearly a line.
  for (const auto& spread : {std::array{1e6, 9e5, 5e5}, std::array{1e6, 7e5, 1e4},
                             std::array{1e6, 1e6, 10.0}, std::array{1e7, 3e4, 1e3}})
    for (int i = 0; i < 500; ++i) {
      const auto neighbors = neighborhood(spread, 6 + i % 40, random);
      const NormalVector normal = plane_normal(grid, neighbors);
      EXPECT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1, 1e-6);
      EXPECT_LT(angle_between(normal, least_direction(neighbors)), 1e-4) << spread[2] << " " << i;
    }
}

TEST(PlaneNormal, DoesNotDependOnTheUnit) {
  std::mt19937 random(4);
  const auto neighbors = neighborhood({1e6, 7e5, 1e4}, 16, random);
  const NormalVector normal = plane_normal({.step = {1, 1, 1}}, neighbors);
  for (const double step : {0x1p-60, 0x1p60}) {
    auto scaled = neighbors;
    for (Neighbor& n : scaled) n.squared_distance *= step * step;
    EXPECT_EQ(plane_normal({.step = {step, step, step}}, scaled), normal);
  }
}

class NormalsOfClouds : public test::StageFixture {
 protected:
  /// Normals in the order of the points, without a sensor.
  std::vector<NormalVector> estimated(const std::vector<GridPoint>& points) {
    formats::PointBlock block;
    block.count = points.size();
    block.steps = points;
    block.columns.resize(1);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const auto bytes = std::as_bytes(std::span(&i, 1));
      block.columns[0].insert(block.columns[0].end(), bytes.begin(), bytes.end());
    }
    Scans scans;
    scans.push_back(test::steps_scan(
        {{"number", formats::ScalarType::kU32, 1, formats::ReduceRule::kNone}}, {block}));
    ImportedPoints imported = import_scans(scans, {}, context());
    const formats::Grid grid = imported.grid;
    const formats::Tree tree(imported.points, 4, 1000);
    SplitPoints split_points = split(std::move(imported), tree, context());
    const EstimatedPoints result =
        estimate({split_points.array, split_points.stride, false, grid, tree, {}},
                 {.normals = true, .neighbors = 16}, context());
    std::vector<NormalVector> normals(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::byte* record = result.array.bytes().data() + i * result.stride + 12;
      std::uint32_t number;
      std::memcpy(&number, record, sizeof number);
      std::memcpy(normals[number].data(), record + sizeof number, sizeof(NormalVector));
    }
    return normals;
  }
};

TEST_F(NormalsOfClouds, AgreeWithPcl) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 200);
  std::vector<GridPoint> points;
  for (int i = 0; i < 20000; ++i) {  // a wavy sheet; floats hold each coordinate
    const double x = random() % 1'000'000, y = random() % 1'000'000;
    points.push_back({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                      static_cast<std::int32_t>(1e5 * std::sin(x / 1e5) + noise(random))});
  }
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const GridPoint& p : points)
    cloud->push_back(
        {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setKSearch(16);
  pcl::PointCloud<pcl::Normal> theirs;
  estimation.compute(theirs);
  const std::vector<NormalVector> ours = estimated(points);
  ASSERT_EQ(theirs.size(), ours.size());
  std::vector<double> angles;
  for (std::size_t i = 0; i < ours.size(); ++i)
    angles.push_back(angle_between(
        std::array{theirs[i].normal_x, theirs[i].normal_y, theirs[i].normal_z}, ours[i]));
  std::sort(angles.begin(), angles.end());
  // PCL sums and solves in float32; where two neighbours are as far from a point it may take the other.
  EXPECT_LT(angles[angles.size() / 2], 0.01);
  EXPECT_LT(angles[angles.size() * 999 / 1000], 0.1);
}

}  // namespace
}  // namespace cairn::stages
