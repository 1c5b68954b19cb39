// Points whose place in the picture is known, drawn by the CPU renderer.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "viewer/cpu/cpu_renderer.h"

namespace cairn::viewer {

inline constexpr PictureSize kSize{64, 48};
inline constexpr ColumnSet kAll{.radius = true, .color = true, .normal = true};
using Rgb = std::array<int, 3>;
inline constexpr Rgb kBackground{shading::kBackground[0], shading::kBackground[1],
                                 shading::kBackground[2]};

inline std::uint32_t packed(const Rgb& rgb) {
  return static_cast<std::uint32_t>(rgb[0] | rgb[1] << 8 | rgb[2] << 16) | 0xff000000;
}

inline Rgb at(const Picture& picture, int x, int y) {
  const std::size_t i = 3 * (static_cast<std::size_t>(y) * picture.size.width + x);
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

/// Looks along x with z up: to the right is -y. Of 90 degrees over 48 rows: the focal length is 24 pixels.
inline constexpr double kFocal = 24;
inline constexpr double kNear = 0.5;
inline View view(PictureSize size = kSize) {
  return {
      {.eye = {0, 0, 0}, .target = {1, 0, 0}, .up = {0, 0, 1}, .fov_y_degrees = 90}, size, kNear};
}

struct Place {
  double x, y;  ///< pixels from the left and from the top
};

/// The point that appears at a place of the picture, at a depth.
inline glm::vec3 seen_at(double x, double y, double depth, PictureSize size = kSize) {
  return {depth, (size.width / 2.0 - x) * depth / kFocal, (size.height / 2.0 - y) * depth / kFocal};
}

struct Point {
  glm::vec3 position{0, 0, 0};
  Rgb rgb{255, 255, 255};
  float radius = 0;
  glm::vec3 normal{0, 0, 0};
};

inline NodePoints node_of(const std::vector<Point>& points) {
  NodePoints node;
  for (const Point& point : points) {
    node.position.push_back(point.position);
    node.radius.push_back(point.radius);
    node.color.push_back(packed(point.rgb));
    node.normal.push_back(pack_normal(point.normal));
  }
  return node;
}

inline constexpr FramePlan kPoints{.primitive = Primitive::kPoints, .color = ColorSource::kColor};
inline constexpr FramePlan kDiscs{.primitive = Primitive::kDiscs, .color = ColorSource::kColor};
inline constexpr FramePlan kSplats{
    .primitive = Primitive::kSplats, .color = ColorSource::kColor, .oriented = true};

inline Picture drawn(const std::vector<Point>& points, const FramePlan& plan,
                     std::uint32_t tint = 0) {
  const auto count = static_cast<std::uint32_t>(points.size());
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = std::max(count, 1u)});
  renderer.upload(0, node_of(points).columns());
  const DrawStatistics statistics = renderer.draw(
      {.view = view(), .plan = plan, .items = {{.slot = 0, .count = count, .tint = tint}}});
  EXPECT_EQ(statistics.points, count);
  EXPECT_EQ(statistics.unseen_points, 0u);
  return renderer.picture();
}

/// Whether exactly the pixels for which `covered(x, y)` holds have another color than the background.
template <typename Covered>
void expect_covered(const Picture& picture, const Covered& covered) {
  for (int y = 0; y < static_cast<int>(picture.size.height); ++y)
    for (int x = 0; x < static_cast<int>(picture.size.width); ++x)
      EXPECT_EQ(at(picture, x, y) != kBackground, covered(x, y)) << x << ", " << y;
}

}  // namespace cairn::viewer
