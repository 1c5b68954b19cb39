// Points and discs that face the eye: each fragment has the depth of its point, and the nearest wins.
#pragma once

#include <cstdint>
#include <span>

#include "viewer/cpu/point_batch.h"
#include "viewer/frame_plan.h"

namespace cairn::viewer {

/// Draws a batch into the picture's words (nearest_buffer.h), rows from the top. `radius`: of the batch's points, world
/// units; used by discs alone. Requires a primitive other than splats. Any number of threads at a time.
void draw_flat(const FramePlan& plan, const Lens& lens, const PointBatch& batch,
               const float* radius, std::span<std::uint64_t> words);

}  // namespace cairn::viewer
