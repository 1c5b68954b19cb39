// Splats that are blended where they lie on one surface, in three passes over the frame: how near the surface is in each
// pixel; the weighted sum of what lies on it; the mean.
// Based on: Botsch, Hornung, Zwicker, Kobbelt, "High-Quality Surface Splatting on Today's GPUs", 2005. Where it departs:
// the surface's depth is the least of fragment depth and blending range together, so that it does not depend on which
// fragment is nearest; weights are a polynomial; sums are whole numbers, exact in any order.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "viewer/cpu/point_batch.h"

namespace cairn::viewer {

/// Weight, and weight times red, green and blue; in units of 1 / kWeightSteps.
using SplatSums = std::array<std::uint64_t, 4>;
inline constexpr float kWeightSteps = 65536;

/// The first pass: of each pixel's word, the depth becomes the least that a fragment reaches with its blending range.
/// `radius`: of the batch's points, world units.
void find_surface(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
                  std::span<std::uint64_t> words);
/// The second: adds what is not behind the surface.
void add_splats(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
                std::span<const std::uint64_t> words, std::span<SplatSums> sums);
/// The third: of each covered pixel's word, the color becomes the mean.
void normalize(std::span<const SplatSums> sums, std::span<std::uint64_t> words);

}  // namespace cairn::viewer
