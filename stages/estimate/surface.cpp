// The one place that knows PCL and Eigen.
// Based on: R. B. Rusu, "Semantic 3D Object Maps for Everyday Manipulation in Human Living Environments", 2009:
// the normal is the direction in which the neighbourhood varies least. Departs from PCL's class
// NormalEstimationOMP, which finds neighbours itself over the whole cloud in memory and in float32: PCL sums
// up the neighbourhoods found here, in coordinates relative to the point and scaled to length 1; and
// the smallest eigenvector comes from Eigen's iteration, which needs roots and fractions alone, where PCL's
// closed form goes through arc tangents and cosines, whose last bits differ between machines.
#include "stages/estimate/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <pcl/common/centroid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <Eigen/Eigenvalues>

#include "formats/error.h"

namespace cairn::stages {

using formats::GridPoint;

namespace {

/// Neighbours on a line vary across it by no more than the rounding to float32, 2^-24 of their distance:
/// squared, and with room, this share of what they vary along it.
constexpr double kLine = 1e-12;

bool is_zero(const NormalVector& n) { return n[0] == 0 && n[1] == 0 && n[2] == 0; }

NormalVector negated(const NormalVector& n) { return {0 - n[0], 0 - n[1], 0 - n[2]}; }

/// Whether the first component that is not zero, of z, x, y, is positive.
bool looks_up(const NormalVector& n) {
  if (n[2] != 0) return n[2] > 0;
  return n[0] != 0 ? n[0] > 0 : n[1] > 0;
}

}  // namespace

struct PlaneFitter::Cloud {
  pcl::PointCloud<pcl::PointXYZ> points;
};

PlaneFitter::PlaneFitter(const formats::Grid& grid)
    : grid_(grid), cloud_(std::make_unique<Cloud>()) {}

PlaneFitter::~PlaneFitter() = default;

NormalVector PlaneFitter::normal(std::span<const Neighbor> neighbors) {
  CAIRN_CHECK(!neighbors.empty());
  if (neighbors.size() < 3) return {0, 0, 0};
  const GridPoint& origin = neighbors.front().position;
  const double size = std::sqrt(neighbors.back().squared_distance);
  std::array<double, 3> scale;
  for (std::size_t axis = 0; axis < 3; ++axis) scale[axis] = grid_.step[axis] / size;
  auto& points = cloud_->points;
  points.resize(neighbors.size());
  for (std::size_t i = 0; i < neighbors.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t steps = std::int64_t{neighbors[i].position[axis]} - origin[axis];
      points[i].data[axis] = static_cast<float>(scale[axis] * static_cast<double>(steps));
    }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  pcl::computeMeanAndCovarianceMatrix(points, covariance, mean);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  if (!(axes.eigenvalues()[1] > kLine * axes.eigenvalues()[2])) return {0, 0, 0};
  const Eigen::Vector3f least = axes.eigenvectors().col(0).cast<float>();
  return {least[0] + 0.0F, least[1] + 0.0F, least[2] + 0.0F};
}

NormalVector turned(const NormalVector& normal, const formats::WorldPoint& position,
                    const std::optional<formats::WorldPoint>& sensor) {
  if (is_zero(normal)) return normal;
  double towards = 0;
  if (sensor)
    for (std::size_t axis = 0; axis < 3; ++axis)
      towards += static_cast<double>(normal[axis]) * ((*sensor)[axis] - position[axis]);
  const bool right = towards != 0 ? towards > 0 : looks_up(normal);
  return right ? normal : negated(normal);
}

float splat_radius(const formats::Grid& grid, std::span<const Neighbor> neighbors) {
  CAIRN_CHECK(!neighbors.empty());
  const double shares = static_cast<double>(neighbors.size()) - 1;
  const double radius = shares == 0 ? *std::max_element(grid.step.begin(), grid.step.end())
                                    : std::sqrt(neighbors.back().squared_distance) *
                                          std::sqrt(std::numbers::pi / (2 * shares));
  return static_cast<float>(std::min(radius, double{std::numeric_limits<float>::max()}));
}

}  // namespace cairn::stages
