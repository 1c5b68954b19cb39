// A few hundred points on their way to the picture: projected and shaded in loops without branches over columns that
// stay in the nearest cache, which the compiler turns into vector instructions.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "viewer/cpu/lens.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

/// Columns of a slot from some point on; those that are absent are null.
struct SlotColumns {
  const float* x = nullptr;  ///< from the center of the node's box
  const float* y = nullptr;
  const float* z = nullptr;
  const float* radius = nullptr;
  const std::uint32_t* color = nullptr;
  const std::uint32_t* normal = nullptr;
};

/// What a frame and an item tell of all their points.
struct BatchRules {
  Lens lens;
  float margin = 0;  ///< pixels beyond the picture's edge within which points are kept
  bool colors = true;
  bool tinted = false;
  bool lighting = false;
  bool cull_back_faces = false;
  bool oriented = false;  ///< normals are wanted in the view's axes
};
BatchRules batch_rules(const Frame& frame);

struct PointBatch {
  static constexpr std::uint32_t kSize = 256;
  using Floats = std::array<float, kSize>;

  std::uint32_t count = 0;
  Floats x, y;                          ///< in the picture, pixels
  Floats depth;                         ///< 0 for points that are left out
  Floats across, along;                 ///< to the right of the eye and above it, world units
  Floats normal_x, normal_y, normal_z;  ///< in the view's axes; zero for none; if `oriented`
  Floats light;                         ///< factor of the color; if `lighting`
  std::array<std::uint32_t, kSize>
      color;  ///< red in the lowest byte; the highest is 0; if `colors`

  /// Takes `points` points, at most kSize, of the columns.
  void fill(const BatchRules& rules, const SlotColumns& columns, std::uint32_t points,
            const glm::vec3& offset, std::uint32_t tint);
};

}  // namespace cairn::viewer
