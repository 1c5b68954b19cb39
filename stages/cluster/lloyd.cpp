#include "stages/cluster/lloyd.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "stages/cluster/center_tree.h"
#include "stages/cluster/normals.h"

namespace cairn::stages {
namespace {

/// Weighted means of the clusters' points, summed up along the curve.
CurvePoints centers_of(const CurvePoints& points, std::uint64_t quota,
                       const std::vector<std::uint32_t>& cluster_of) {
  struct Sum {
    double weight = 0;
    std::array<double, 3> place{}, facing{};
  };
  std::vector<Sum> sums(quota);
  for (std::size_t i = 0; i < cluster_of.size(); ++i) {
    Sum& sum = sums[cluster_of[i]];
    const double w = points.weight_of(i);
    sum.weight += w;
    sum.place[0] += w * points.x[i];
    sum.place[1] += w * points.y[i];
    sum.place[2] += w * points.z[i];
    if (!points.has_normals()) continue;
    sum.facing[0] += w * double{points.nx[i]};
    sum.facing[1] += w * double{points.ny[i]};
    sum.facing[2] += w * double{points.nz[i]};
  }
  CurvePoints centers;
  for (std::vector<double>* column : {&centers.x, &centers.y, &centers.z}) column->resize(quota);
  for (std::size_t r = 0; r < quota; ++r) {
    centers.x[r] = sums[r].place[0] / sums[r].weight;
    centers.y[r] = sums[r].place[1] / sums[r].weight;
    centers.z[r] = sums[r].place[2] / sums[r].weight;
  }
  if (!points.has_normals()) return centers;
  for (std::vector<float>* column : {&centers.nx, &centers.ny, &centers.nz}) column->resize(quota);
  for (std::size_t r = 0; r < quota; ++r) {
    const auto& [x, y, z] = sums[r].facing;
    const double length = std::sqrt(x * x + y * y + z * z);
    if (length <= kCancelled * sums[r].weight) continue;
    centers.nx[r] = static_cast<float>(x / length);
    centers.ny[r] = static_cast<float>(y / length);
    centers.nz[r] = static_cast<float>(z / length);
  }
  return centers;
}

/// For each cluster the point nearest to its center, the first of several.
std::vector<std::uint32_t> points_that_stay(const CurvePoints& points, const CurvePoints& centers,
                                            const std::vector<std::uint32_t>& cluster_of) {
  struct Nearest {
    double square = std::numeric_limits<double>::infinity();
    std::uint32_t point = 0;
  };
  std::vector<Nearest> nearest(centers.count());
  for (std::uint32_t i = 0; i < cluster_of.size(); ++i) {
    const std::uint32_t r = cluster_of[i];
    const double x = points.x[i] - centers.x[r], y = points.y[i] - centers.y[r],
                 z = points.z[i] - centers.z[r];
    const double square = x * x + y * y + z * z;
    if (square < nearest[r].square) nearest[r] = {square, i};
  }
  std::vector<std::uint32_t> stays;
  stays.reserve(nearest.size());
  for (const Nearest& best : nearest) stays.push_back(best.point);
  return stays;
}

}  // namespace

void lloyd_pass(const CurvePoints& points, float theta_degrees, std::uint64_t quota,
                std::vector<std::uint32_t>& cluster_of) {
  CurvePoints centers = centers_of(points, quota, cluster_of);
  const std::vector<std::uint32_t> stays = points_that_stay(points, centers, cluster_of);
  CenterTree(std::move(centers))
      .move_to_nearest(points, cosine_of_limit(theta_degrees), cluster_of);
  for (std::uint32_t r = 0; r < quota; ++r) cluster_of[stays[r]] = r;
}

}  // namespace cairn::stages
