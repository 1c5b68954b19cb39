#include "viewer/gl/gl_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/viewer/gl_fixture.h"

namespace cairn::viewer::tests {
namespace {

using testing::Each;
using testing::ElementsAre;

TEST_F(GlRendererTest, DrawsAPointOnThePixelThatHoldsItsProjection) {
  for (const auto& [x, y] :
       {std::pair{10.2f, 20.7f}, {0.1f, 0.1f}, {63.9f, 63.9f}, {40.9f, 3.1f}}) {
    const Drawn drawn = draw({{{seen_at(x, y, 3), kGreen}}}, points_plan());
    EXPECT_EQ(covered_pixels(drawn.picture), 1u) << x << ' ' << y;
    EXPECT_THAT(pixel(drawn.picture, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)),
                ElementsAre(0, 255, 0));
  }
  EXPECT_EQ(renderer_->draw({view_along_y(kSize), points_plan(), {{.count = 1}}}).points, 1u);
}

TEST_F(GlRendererTest, DrawsNothingBeforeTheNearPlaneOrBehindTheEye) {
  const Drawn drawn = draw({{{{0, 0.09f, 0}}, {{0, -1, 0}}, {{0, 0, 0}}}}, points_plan());
  EXPECT_EQ(covered_pixels(drawn.picture), 0u);
  EXPECT_EQ(covered_pixels(draw({{{{0, 0.11f, 0}}}}, points_plan()).picture), 1u);
  EXPECT_EQ(covered_pixels(draw({{{{0, 1e9f, 0}}}}, points_plan()).picture), 1u);
}

TEST_F(GlRendererTest, DrawsSquaresOfTheSizeAskedFor) {
  FramePlan plan = points_plan();
  plan.point_pixels = 5;
  const Drawn drawn = draw({{{seen_at(20.5f, 30.5f, 1)}}}, plan);
  EXPECT_EQ(covered_pixels(drawn.picture), 25u);
  EXPECT_THAT(pixel(drawn.picture, 18, 28), ElementsAre(255, 255, 255));
  EXPECT_THAT(pixel(drawn.picture, 22, 32), ElementsAre(255, 255, 255));
}

TEST_F(GlRendererTest, NearestPointWinsInAnyOrder) {
  const ScenePoint near{seen_at(8.5f, 8.5f, 1), kRed};
  const ScenePoint far{seen_at(8.5f, 8.5f, 1.0001f), kBlue};
  for (const auto& slots : {std::vector<std::vector<ScenePoint>>{{near, far}},
                            {{far, near}},
                            {{near}, {far}},
                            {{far}, {near}}})
    EXPECT_THAT(pixel(draw(slots, points_plan()).picture, 8, 8), ElementsAre(255, 0, 0));
}

TEST_F(GlRendererTest, AddsTheItemsOffsetAndTakesItsTint) {
  make({{{{-5, 0, 7}, kRed}, {seen_at(3.5f, 3.5f, 1), kRed}}});
  FramePlan plan = points_plan();
  plan.color = ColorSource::kLevel;
  const Drawn drawn = draw({view_along_y(kSize),
                            plan,
                            {{.count = 1, .offset = glm::vec3(5.01f, 2, -7.01f), .tint = kBlue},
                             {.first = 1, .count = 1, .tint = kGreen}}});
  EXPECT_THAT(pixel(drawn.picture, 32, 32), ElementsAre(0, 0, 255));
  EXPECT_THAT(pixel(drawn.picture, 3, 3), ElementsAre(0, 255, 0));
}

TEST_F(GlRendererTest, ShadesByTheAngleOfNormalAndSight) {
  FramePlan plan = points_plan();
  plan.lighting = true;
  const float sine = std::sqrt(0.75f);
  const std::uint32_t gray = 0xffc8c8c8;  // 200
  const Drawn drawn = draw(
      {{{{0.01f, 2, -0.01f}, gray, 0.1f, {sine, 0.5f, 0}}, {seen_at(5.5f, 32.5f, 1), gray}}}, plan);
  // cos 60 = 1/2: 200 (1/4 + 3/4 1/2) = 125. Without a normal the color stays.
  EXPECT_THAT(pixel(drawn.picture, 32, 32),
              Each(testing::AllOf(testing::Ge(124), testing::Le(126))));
  EXPECT_THAT(pixel(drawn.picture, 5, 32), Each(200));
}

TEST_F(GlRendererTest, LeavesOutBackFacesOnlyIfAsked) {
  const std::vector<std::vector<ScenePoint>> slots = {
      {{seen_at(5.5f, 5.5f, 1), kRed, 0.01f, {0, 1, 0}},
       {seen_at(9.5f, 9.5f, 1), kRed, 0.01f, {0, -1, 0}},
       {seen_at(20.5f, 9.5f, 1), kRed}}};
  FramePlan plan = points_plan();
  EXPECT_EQ(covered_pixels(draw(slots, plan).picture), 3u);
  plan.cull_back_faces = true;
  const Drawn drawn = draw(slots, plan);
  EXPECT_EQ(covered_pixels(drawn.picture), 2u);
  EXPECT_EQ(pixel(drawn.picture, 5, 5), kBackgroundPixel);
}

TEST_F(GlRendererTest, EyeDomeLightingFollowsTheFormula) {
  // Two squares side by side, the left one farther.
  FramePlan plan = points_plan();
  plan.point_pixels = 16;
  plan.eye_dome = true;
  const float step = 1.02f;
  const Drawn drawn = draw({{{seen_at(16, 32, 2 * step)}, {seen_at(32, 32, 2)}}}, plan);
  const auto factor = [&](int nearer) {
    return std::exp(-shading::kEyeDomeStrength * static_cast<float>(nearer) / 8 * std::log2(step));
  };
  // Two pixels to the right of column 23 is the near square: of eight neighbors, three.
  EXPECT_NEAR(pixel(drawn.picture, 23, 32)[0], 255 * factor(3), 1.01);
  EXPECT_NEAR(pixel(drawn.picture, 22, 32)[0], 255 * factor(3), 1.01);
  EXPECT_NEAR(pixel(drawn.picture, 23, 24)[0], 255 * factor(2),
              1.01);  // the upper one lies beyond both
  EXPECT_EQ(pixel(drawn.picture, 21, 32)[0], 255);
  EXPECT_EQ(pixel(drawn.picture, 24, 32)[0], 255);
  EXPECT_EQ(pixel(drawn.picture, 4, 4), kBackgroundPixel);
}

TEST_F(GlRendererTest, DrawsMoreItemsThanItsBuffersHold) {
  std::vector<ScenePoint> points;
  for (std::uint32_t i = 0; i < 1000; ++i)
    points.push_back(
        {seen_at(0.5f + static_cast<float>(i % 50), 0.5f + static_cast<float>(i / 50), 1)});
  make({points});
  for (const FramePlan& plan : {points_plan(), splats_plan()}) {
    Frame frame{view_along_y(kSize), plan, {}};
    for (std::uint32_t i = 0; i < 1000; ++i)
      frame.items.push_back({.first = i, .count = 1, .region = i});
    EXPECT_EQ(covered_pixels(draw(frame).picture), 1000u);
    frame.plan.occlusion_queries = true;
    const Drawn drawn = draw(frame);
    EXPECT_EQ(covered_pixels(drawn.picture), 1000u);
    EXPECT_THAT(drawn.statistics.seen, Each(testing::Field(&RegionSeen::seen, true)));
  }
}

TEST_F(GlRendererTest, UploadReplacesWhatASlotHeld) {
  make({{{seen_at(1.5f, 1.5f, 1)}, {seen_at(3.5f, 3.5f, 1)}}, {{seen_at(5.5f, 5.5f, 1)}}});
  renderer_->upload(0, points_of({{seen_at(7.5f, 7.5f, 1), kRed}}).columns());
  const Drawn drawn =
      draw({view_along_y(kSize), points_plan(), {{.count = 1}, {.slot = 1, .count = 1}}});
  EXPECT_EQ(covered_pixels(drawn.picture), 2u);
  EXPECT_THAT(pixel(drawn.picture, 7, 7), ElementsAre(255, 0, 0));
  EXPECT_THAT(pixel(drawn.picture, 5, 5), Each(255));
}

TEST_F(GlRendererTest, DrawsAnEmptyFrame) {
  for (const FramePlan& plan : {points_plan(), splats_plan()}) {
    make({{}});
    FramePlan with_all = plan;
    with_all.eye_dome = with_all.occlusion_queries = true;
    const Drawn drawn = draw({view_along_y(kSize), with_all, {}});
    EXPECT_EQ(covered_pixels(drawn.picture), 0u);
    EXPECT_EQ(drawn.statistics.points, 0u);
  }
}

TEST_F(GlRendererTest, DrawsTheEdgesOfBoxesHiddenByPoints) {
  FramePlan plan = points_plan();
  plan.point_pixels = 20;
  make({{{seen_at(32, 16, 1), kRed}}});
  draw({view_along_y(kSize), plan, {{.count = 1}}});
  // A box whose front face reaches from pixel 16 to 48 at a depth of 2, and whose back face is half
  // as large.
  const BoxLine box{.center = {0, 3, 0}, .half = {1, 1, 1}, .color = kGreen};
  renderer_->draw_boxes(std::span(&box, 1));
  const Picture picture = renderer_->picture();
  EXPECT_THAT(pixel(picture, 32, 16), ElementsAre(255, 0, 0));
  const auto green_near = [&](std::uint32_t x, std::uint32_t y) {
    bool green = false;
    for (std::uint32_t i = x - 1; i <= x; ++i)
      for (std::uint32_t j = y - 1; j <= y; ++j)
        green |= pixel(picture, i, j) == std::array{0, 255, 0};
    return green;
  };
  EXPECT_TRUE(green_near(32, 48));
  EXPECT_TRUE(green_near(16, 32));
  EXPECT_TRUE(green_near(48, 32));
  EXPECT_TRUE(green_near(32, 40));  // of the back face
  EXPECT_EQ(pixel(picture, 32, 32), kBackgroundPixel);
}

TEST_F(GlRendererTest, ShowsThePictureUpright) {
  make({{{seen_at(10.5f, 5.5f, 1), kRed}}});
  draw({view_along_y(kSize), points_plan(), {{.count = 1}}});
  gl::Texture texture = gl::make_texture(GL_TEXTURE_2D);
  glTextureStorage2D(texture.name(), 1, GL_RGBA8, kPixels, kPixels);
  const gl::Framebuffer framebuffer = gl::make_framebuffer();
  glNamedFramebufferTexture(framebuffer.name(), GL_COLOR_ATTACHMENT0, texture.name(), 0);
  renderer_->show(framebuffer.name(), kSize);
  std::array<std::uint8_t, 4> color{};
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.name());
  glReadPixels(10, kPixels - 1 - 5, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE,
               color.data());  // from the bottom
  EXPECT_THAT(color, ElementsAre(255, 0, 0, 255));
}

formats::ErrorKind kind_of(const RendererSize& size) {
  try {
    GlRenderer renderer(size);
  } catch (const formats::Error& error) {
    return error.kind();
  }
  return formats::ErrorKind{0};
}

TEST_F(GlRendererTest, RefusesMoreThanItCanHold) {
  EXPECT_EQ(kind_of({kAllColumns, 40000, 65536}), formats::ErrorKind::kUsage);
  EXPECT_EQ(kind_of({kAllColumns, 30000, 65536}), formats::ErrorKind::kSystem);
  EXPECT_EQ(kind_of({kAllColumns, 1, 0}), formats::ErrorKind::kInvariant);
}

TEST_F(GlRendererTest, ChecksWhatItIsGiven) {
  GlRenderer renderer({{}, 2, 10});
  EXPECT_THROW(renderer.picture(), formats::Error);
  const std::vector<glm::vec3> eleven(11);
  const std::vector<float> radii(1);
  EXPECT_THROW(renderer.upload(0, {.position = eleven}), formats::Error);
  EXPECT_THROW(renderer.upload(2, {}), formats::Error);
  EXPECT_THROW(renderer.upload(0, {.position = std::span(eleven).first(1), .radius = radii}),
               formats::Error);
  FramePlan plan;
  EXPECT_THROW(renderer.draw({view_along_y(kSize), plan, {{.slot = 2, .count = 1}}}),
               formats::Error);
  EXPECT_THROW(renderer.draw({view_along_y(kSize), plan, {{.first = 5, .count = 6}}}),
               formats::Error);
  plan.lighting = true;
  EXPECT_THROW(renderer.draw({view_along_y(kSize), plan, {}}), formats::Error);
}

}  // namespace
}  // namespace cairn::viewer::tests
