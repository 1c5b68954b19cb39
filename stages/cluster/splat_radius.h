// Splat radii: of input points that have none, and of representatives.
#pragma once

#include <span>
#include <vector>

#include "formats/dataset/grid.h"
#include "stages/cluster/curve_order.h"

namespace cairn::stages {

/// A radius for each point from the density of the points around it, with no neighbour search: the
/// points of a clustering cell of about 16 are taken to lie evenly on a surface patch as large as the
/// two longest sides of their box, and half the diagonal of a point's square share covers it.
std::vector<float> radii_from_density(const formats::Grid& grid,
                                      std::span<const formats::GridPoint> points,
                                      const CurveOrder& curve);

/// The radius that a representative is drawn with: its disc has the area of the discs that it stands
/// for together. `squared_sum` is the sum of their squared radii.
float merged_radius(double squared_sum);

}  // namespace cairn::stages
