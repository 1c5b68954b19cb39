// A view in single precision, as points are projected by it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "viewer/camera.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

/// A point p, from the eye, has the depth z = forward . p and appears at
/// (center_x + focal (right . p) / z, center_y - focal (up . p) / z), pixels from the left and from the top.
struct Lens {
  glm::vec3 right, up, forward;
  float focal;
  float near;
  float center_x, center_y;
  int width, height;  ///< pixels
};

inline Lens lens_of(const View& view) {
  const PictureSize size = view.size();
  return {.right = glm::vec3(view.right()),
          .up = glm::vec3(view.up()),
          .forward = glm::vec3(view.forward()),
          .focal = static_cast<float>(view.focal_pixels()),
          .near = static_cast<float>(view.near()),
          .center_x = static_cast<float>(size.width) / 2,
          .center_y = static_cast<float>(size.height) / 2,
          .width = static_cast<int>(size.width),
          .height = static_cast<int>(size.height)};
}

/// A range of whole pixels of one axis.
struct PixelRange {
  int begin, end;
};

/// The pixels of 0..size whose centers lie in [middle - half, middle + half). Requires finite numbers.
inline PixelRange pixels_around(float middle, float half, int size) {
  // The first whole number not below; clamping first keeps the conversion defined.
  const auto not_below = [size](float value) {
    if (!(value > 0)) return 0;
    if (value >= static_cast<float>(size)) return size;
    const int whole = static_cast<int>(value);
    return whole + (static_cast<float>(whole) < value ? 1 : 0);
  };
  return {not_below(middle - half - 0.5f), not_below(middle + half - 0.5f)};
}

/// The index of the pixel that contains a place, rows from the top, or -1 beside the picture. Requires finite numbers
/// that an int holds.
inline std::int64_t pixel_of(const Lens& lens, float x, float y) {
  if (!(x >= 0 && y >= 0)) return -1;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  if (column >= lens.width || row >= lens.height) return -1;
  return std::int64_t{row} * lens.width + column;
}

/// Radius in pixels at which a disc is drawn; for what is not a number, the smallest. Requires depth > 0.
inline float drawn_pixel_radius(const Lens& lens, float radius, float depth) {
  const float pixels = radius * lens.focal / depth;
  if (!(pixels > shading::kMinPixelRadius)) return shading::kMinPixelRadius;
  return pixels < shading::kMaxPixelRadius ? pixels : shading::kMaxPixelRadius;
}

}  // namespace cairn::viewer
