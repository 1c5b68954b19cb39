// Frames for tests of renderers: a camera at the origin that looks along y, x to the right and z
// up, with a focal length of half a picture; so a point (x, y, z) appears at (n/2 + n/2 x/y, n/2 -
// n/2 z/y) of n pixels.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <vector>

#include "formats/error.h"
#include "viewer/gl/gl_renderer.h"
#include "viewer/gl/headless_context.h"

namespace cairn::viewer::tests {

inline constexpr std::uint32_t kRed = 0xff0000ff, kGreen = 0xff00ff00, kBlue = 0xffff0000,
                               kWhite = 0xffffffff;

inline View view_along_y(PictureSize size, double near = 0.1) {
  Camera camera;
  camera.target = {0, 1, 0};
  camera.fov_y_degrees = 90;
  return {camera, size, near};
}

/// All columns, whether the plan needs them or not.
inline constexpr ColumnSet kAllColumns{.radius = true, .color = true, .normal = true};

struct ScenePoint {
  glm::vec3 position{0, 0, 0};
  std::uint32_t color = kWhite;
  float radius = 0.01f;
  glm::vec3 normal{0, 0, 0};  ///< zero: none
};

inline NodePoints points_of(const std::vector<ScenePoint>& scene) {
  NodePoints points;
  for (const ScenePoint& point : scene) {
    points.position.push_back(point.position);
    points.color.push_back(point.color);
    points.radius.push_back(point.radius);
    points.normal.push_back(point.normal == glm::vec3(0) ? 0 : pack_normal(point.normal));
  }
  return points;
}

inline std::array<int, 3> pixel(const Picture& picture, std::uint32_t x, std::uint32_t y) {
  const std::uint8_t* rgb = &picture.rgb[3 * (std::size_t{y} * picture.size.width + x)];
  return {rgb[0], rgb[1], rgb[2]};
}
inline constexpr std::array<int, 3> kBackgroundPixel = {
    shading::kBackground[0], shading::kBackground[1], shading::kBackground[2]};

inline std::size_t covered_pixels(const Picture& picture) {
  std::size_t covered = 0;
  for (std::uint32_t y = 0; y < picture.size.height; ++y)
    for (std::uint32_t x = 0; x < picture.size.width; ++x)
      covered += pixel(picture, x, y) != kBackgroundPixel ? 1 : 0;
  return covered;
}

/// Makes an OpenGL context for each test; skips it, saying why, where there is none.
class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<HeadlessContext>();
    } catch (const formats::Error& error) {
      if (std::getenv("CAIRN_SHARED_DATA_REQUIRED") != nullptr) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<HeadlessContext> context_;
};

inline constexpr std::uint32_t kPixels = 64;
inline constexpr float kFocal = kPixels / 2;
inline constexpr PictureSize kSize{kPixels, kPixels};

struct Drawn {
  Picture picture;
  DrawStatistics statistics;
};

class GlRendererTest : public GlTest {
 protected:
  /// One slot a list of points, one item a slot.
  Drawn draw(const std::vector<std::vector<ScenePoint>>& slots, const FramePlan& plan) {
    make(slots);
    Frame frame{view_along_y(kSize), plan, {}};
    for (std::uint32_t slot = 0; slot < slots.size(); ++slot)
      frame.items.push_back(item(slot, slots));
    return draw(frame);
  }
  Drawn draw(const Frame& frame) {
    Drawn drawn;
    drawn.statistics = renderer_->draw(frame);
    drawn.picture = renderer_->picture();
    return drawn;
  }
  void make(const std::vector<std::vector<ScenePoint>>& slots) {
    std::size_t most = 1;
    for (const auto& points : slots) most = std::max(most, points.size());
    renderer_.reset();
    renderer_ = std::make_unique<GlRenderer>(RendererSize{
        kAllColumns, static_cast<std::uint32_t>(std::max<std::size_t>(1, slots.size())),
        static_cast<std::uint32_t>(most)});
    for (std::uint32_t slot = 0; slot < slots.size(); ++slot)
      renderer_->upload(slot, points_of(slots[slot]).columns());
  }
  static DrawItem item(std::uint32_t slot, const std::vector<std::vector<ScenePoint>>& slots) {
    return {.slot = slot,
            .count = static_cast<std::uint32_t>(slots[slot].size()),
            .region = 100 + slot};
  }
  void TearDown() override { renderer_.reset(); }

  std::unique_ptr<GlRenderer> renderer_;
};

inline FramePlan points_plan() {
  return {.primitive = Primitive::kPoints, .color = ColorSource::kColor};
}
inline FramePlan discs_plan() {
  return {.primitive = Primitive::kDiscs, .color = ColorSource::kColor};
}
inline FramePlan splats_plan() {
  return {.primitive = Primitive::kSplats, .color = ColorSource::kColor, .oriented = true};
}

/// A point that appears at this place of the picture.
inline glm::vec3 seen_at(float x, float y, float depth) {
  return {(x - kFocal) / kFocal * depth, depth, (kFocal - y) / kFocal * depth};
}
/// The radius that appears as so many pixels at a depth.
inline float radius_of(float pixels, float depth) { return pixels / kFocal * depth; }

}  // namespace cairn::viewer::tests
