#include "stages/cluster/splat_radius.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/cluster/cell_lists.h"

namespace cairn::stages {

using formats::Grid;
using formats::GridBox;
using formats::GridPoint;

namespace {

/// Half the diagonal of a square of side 1.
constexpr double kHalfDiagonal = 0.70710678118654752;

/// Distance between neighbours if `count` points fill the box evenly: as a surface, or as a line where
/// the box has one extent only; 0 if it has none.
double spacing(const Grid& grid, const GridBox& box, std::uint64_t count) {
  std::array<double, 3> side;
  for (int axis = 0; axis < 3; ++axis) side[axis] = grid.step[axis] * box.span(axis);
  std::sort(side.begin(), side.end());
  // A box through the outermost points lacks half a spacing at each side.
  const double per_side = std::sqrt(static_cast<double>(count));
  const double area = side[2] * side[1];
  if (area > 0 && count >= 4)
    return std::max(std::sqrt(area) / (per_side - 1), side[2] / (static_cast<double>(count) - 1));
  return count >= 2 ? side[2] / (static_cast<double>(count) - 1) : 0;
}

}  // namespace

std::vector<float> radii_from_density(const Grid& grid, std::span<const GridPoint> points,
                                      const CurveOrder& curve) {
  const std::vector<std::uint32_t> starts =
      cut_lists(curve.key, auto_cell_bits(curve.key), kAutoListLength);
  std::vector<double> spacings;
  double sum = 0;
  std::uint64_t measured = 0;
  for (std::size_t list = 0; list + 1 < starts.size(); ++list) {
    GridBox box;
    for (std::uint32_t i = starts[list]; i < starts[list + 1]; ++i) box.add(points[curve.order[i]]);
    spacings.push_back(spacing(grid, box, starts[list + 1] - starts[list]));
    if (spacings.back() > 0) {
      sum += spacings.back();
      ++measured;
    }
  }
  // A cell that tells no spacing takes the mean of the others; a node of one position a grid step.
  const double fallback = measured > 0 ? sum / static_cast<double>(measured)
                                       : *std::max_element(grid.step.begin(), grid.step.end());
  std::vector<float> radii(points.size());
  for (std::size_t list = 0; list + 1 < starts.size(); ++list) {
    const double radius = kHalfDiagonal * (spacings[list] > 0 ? spacings[list] : fallback);
    const float rounded =
        static_cast<float>(std::min(radius, double{std::numeric_limits<float>::max()}));
    for (std::uint32_t i = starts[list]; i < starts[list + 1]; ++i) radii[curve.order[i]] = rounded;
  }
  return radii;
}

float merged_radius(double squared_sum) {
  const double radius = std::sqrt(squared_sum);
  return static_cast<float>(std::min(radius, double{std::numeric_limits<float>::max()}));
}

}  // namespace cairn::stages
