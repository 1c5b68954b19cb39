#include "viewer/cpu/splat_pass.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "viewer/cpu/nearest_buffer.h"
#include "viewer/cpu/rounding.h"

namespace cairn::viewer {
namespace {

struct Splat {
  float x, y;                          ///< in the picture, pixels
  float across, along, depth;          ///< in the view's axes
  float normal_x, normal_y, normal_z;  ///< likewise; zero for a disc that faces the eye
  float radius;                        ///< world units, as it is drawn
  float pixel_radius;
};

Splat splat_of(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
               std::uint32_t i) {
  const float pixels = drawn_pixel_radius(lens, radius[i], batch.depth[i]);
  const float least = shading::kMinPixelRadius * batch.depth[i] / lens.focal;
  return {.x = batch.x[i],
          .y = batch.y[i],
          .across = batch.across[i],
          .along = batch.along[i],
          .depth = batch.depth[i],
          .normal_x = oriented ? batch.normal_x[i] : 0,
          .normal_y = oriented ? batch.normal_y[i] : 0,
          .normal_z = oriented ? batch.normal_z[i] : 0,
          .radius = radius[i] > least ? radius[i] : least,
          .pixel_radius = pixels};
}

float weight_at(float square_of_distance) {
  const float falling = 1 - square_of_distance;
  return falling * falling;
}

/// Calls visit(pixel, depth, weight) for the fragments of a disc that faces the eye, but not for `middle`.
template <typename Visit>
void visit_facing(const Lens& lens, const Splat& splat, std::int64_t middle, const Visit& visit) {
  const PixelRange columns = pixels_around(splat.x, splat.pixel_radius, lens.width);
  const PixelRange rows = pixels_around(splat.y, splat.pixel_radius, lens.height);
  const float scale = 1 / (splat.pixel_radius * splat.pixel_radius);
  for (int row = rows.begin; row < rows.end; ++row) {
    const float dy = static_cast<float>(row) + 0.5f - splat.y;
    for (int column = columns.begin; column < columns.end; ++column) {
      const float dx = static_cast<float>(column) + 0.5f - splat.x;
      const float square = (dx * dx + dy * dy) * scale;
      const std::int64_t pixel = std::int64_t{row} * lens.width + column;
      if (square <= 1 && pixel != middle) visit(pixel, splat.depth, weight_at(square));
    }
  }
}

/// The same for a disc in its surface. The line of sight through a pixel, q with depth 1, meets the disc's plane at t q,
/// t = n . p / n . q, which is a fragment of depth t if it lies within the disc.
template <typename Visit>
void visit_oriented(const Lens& lens, const Splat& splat, std::int64_t middle, const Visit& visit) {
  const PixelRange columns = pixels_around(splat.x, splat.pixel_radius, lens.width);
  const PixelRange rows = pixels_around(splat.y, splat.pixel_radius, lens.height);
  const float pixel_size = 1 / lens.focal;
  const float scale = 1 / (splat.radius * splat.radius);
  const float plane =
      splat.normal_x * splat.across + splat.normal_y * splat.along + splat.normal_z * splat.depth;
  for (int row = rows.begin; row < rows.end; ++row) {
    const float qy = (lens.center_y - (static_cast<float>(row) + 0.5f)) * pixel_size;
    const float row_slope = splat.normal_y * qy + splat.normal_z;
    for (int column = columns.begin; column < columns.end; ++column) {
      const float qx = (static_cast<float>(column) + 0.5f - lens.center_x) * pixel_size;
      const float t = plane / (splat.normal_x * qx + row_slope);
      const float dx = t * qx - splat.across;
      const float dy = t * qy - splat.along;
      const float dz = t - splat.depth;
      const float square = (dx * dx + dy * dy + dz * dz) * scale;
      const std::int64_t pixel = std::int64_t{row} * lens.width + column;
      if (square <= 1 && t > lens.near && pixel != middle) visit(pixel, t, weight_at(square));
    }
  }
}

/// Calls visit(i, splat, pixel, depth, weight) for all fragments of a batch.
template <typename Visit>
void visit_fragments(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
                     const Visit& visit) {
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    if (batch.depth[i] == 0) continue;
    const Splat splat = splat_of(lens, oriented, batch, radius, i);
    const auto visit_one = [&](std::int64_t pixel, float depth, float weight) {
      visit(i, splat, pixel, depth, weight);
    };
    const std::int64_t middle = pixel_of(lens, splat.x, splat.y);
    if (middle >= 0) visit_one(middle, splat.depth, 1);
    if (splat.normal_x == 0 && splat.normal_y == 0 && splat.normal_z == 0)
      visit_facing(lens, splat, middle, visit_one);
    else
      visit_oriented(lens, splat, middle, visit_one);
  }
}

void add(std::uint64_t& sum, std::uint64_t value) {
  std::atomic_ref(sum).fetch_add(value, std::memory_order_relaxed);
}

}  // namespace

void find_surface(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
                  std::span<std::uint64_t> words) {
  visit_fragments(lens, oriented, batch, radius,
                  [&](std::uint32_t, const Splat& splat, std::int64_t pixel, float depth, float) {
                    const float reach = depth + shading::kBlendRadii * splat.radius;
                    keep_least(words[static_cast<std::size_t>(pixel)], pixel_word(reach, 0));
                  });
}

void add_splats(const Lens& lens, bool oriented, const PointBatch& batch, const float* radius,
                std::span<const std::uint64_t> words, std::span<SplatSums> sums) {
  visit_fragments(
      lens, oriented, batch, radius,
      [&](std::uint32_t i, const Splat&, std::int64_t pixel, float depth, float weight) {
        if (pixel_word(depth, 0) > words[static_cast<std::size_t>(pixel)]) return;
        // Never 0: a covered pixel has a color.
        const std::uint64_t steps = std::max<std::uint64_t>(1, rounded(weight * kWeightSteps));
        const std::uint32_t color = batch.color[i];
        SplatSums& sum = sums[static_cast<std::size_t>(pixel)];
        add(sum[0], steps);
        add(sum[1], steps * (color & 0xff));
        add(sum[2], steps * (color >> 8 & 0xff));
        add(sum[3], steps * (color >> 16));
      });
}

void normalize(std::span<const SplatSums> sums, std::span<std::uint64_t> words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto& [weight, red, green, blue] = sums[i];
    if (weight == 0) continue;
    const std::uint64_t half = weight / 2;
    words[i] |= (red + half) / weight | (green + half) / weight << 8 | (blue + half) / weight << 16;
  }
}

}  // namespace cairn::viewer
