// Refinement of clusters: every point moves to the nearest center, every center to the mean of its points.
// Source: S. Lloyd, "Least squares quantization in PCM", IEEE Transactions on Information Theory, 1982. Here a point keeps to
// centers that face its way, and no center loses all of its points.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/cluster/curve_points.h"

namespace cairn::stages {

/// One pass over a node's points. `cluster_of`: for each point along the curve its cluster, of which there are `quota`, each
/// with at least one point; so it is afterwards, unordered. A point moves to the nearest center if that is nearer than its
/// own and if its normal deviates from the center's by at most `theta_degrees`, or by no more than from its own center's.
/// The point of a cluster that is nearest to its center stays. Distances are told apart to single precision.
void lloyd_pass(const CurvePoints& points, float theta_degrees, std::uint64_t quota,
                std::vector<std::uint32_t>& cluster_of);

}  // namespace cairn::stages
