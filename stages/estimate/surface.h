// What a neighbourhood tells of the surface: its normal and how far apart its points lie.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "formats/dataset/grid.h"
#include "stages/neighbors/neighbor_set.h"

namespace cairn::stages {

using NormalVector = std::array<float, 3>;

/// The unit normal of the plane nearest to the neighbours (least squares through their mean), of either sign; zero where
/// no plane is told: fewer than three neighbours, or all on a line. Requires neighbours sorted, the position itself first.
NormalVector plane_normal(const formats::Grid& grid, std::span<const Neighbor> neighbors);

/// Turns a normal at `position` (world units) to the side of the sensor. Without a sensor, or where the
/// surface is seen edge-on, to the side of +z; a vertical surface to +x, and one across y to +y.
NormalVector turned(const NormalVector& normal, const formats::WorldPoint& position,
                    const std::optional<formats::WorldPoint>& sensor);

/// The radius of a splat in the middle of a neighbourhood: the m neighbours share the disc that reaches to
/// the last of them, so m - 1 of them an area of pi d^2, and half the diagonal of a square of one share
/// is d sqrt(pi / (2 (m - 1))); discs of it just cover a square lattice. A lone position gets the grid's
/// longest step. Requires neighbours sorted, the position itself first.
float splat_radius(const formats::Grid& grid, std::span<const Neighbor> neighbors);

}  // namespace cairn::stages
