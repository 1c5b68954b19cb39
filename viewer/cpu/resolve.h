// From the pixels' words to the picture, with eye-dome lighting where it is wanted.
// Based on: Boucheny, "Interactive Scientific Visualization of Large Datasets: Towards a Perceptive-Based Approach",
// 2009, as shading::kEyeDomeStrength tells it.
#pragma once

#include <cstdint>
#include <span>

#include "viewer/picture.h"

namespace cairn::viewer {

/// Fills `picture.rgb`. Requires a word a pixel (nearest_buffer.h), rows from the top. Runs in parallel.
void resolve(std::span<const std::uint64_t> words, bool eye_dome, Picture& picture);

}  // namespace cairn::viewer
