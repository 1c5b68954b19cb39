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

constexpr std::uint32_t kPixels = 64;
constexpr float kFocal = kPixels / 2;
constexpr PictureSize kSize{kPixels, kPixels};

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

FramePlan points_plan() { return {.primitive = Primitive::kPoints, .color = ColorSource::kColor}; }
FramePlan discs_plan() { return {.primitive = Primitive::kDiscs, .color = ColorSource::kColor}; }
FramePlan splats_plan() {
  return {.primitive = Primitive::kSplats, .color = ColorSource::kColor, .oriented = true};
}

/// A point that appears at this place of the picture.
glm::vec3 seen_at(float x, float y, float depth) {
  return {(x - kFocal) / kFocal * depth, depth, (kFocal - y) / kFocal * depth};
}
/// The radius that appears as so many pixels at a depth.
float radius_of(float pixels, float depth) { return pixels / kFocal * depth; }

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

/// Counts pixels where the picture is not `color` although the test says so, or the other way round.
template <typename Covers>
int wrong_pixels(const Picture& picture, std::array<int, 3> color, Covers covers) {
  int wrong = 0;
  for (std::uint32_t y = 0; y < picture.size.height; ++y)
    for (std::uint32_t x = 0; x < picture.size.width; ++x)
      wrong += (pixel(picture, x, y) == color) != covers(x + 0.5, y + 0.5) ? 1 : 0;
  return wrong;
}

TEST_F(GlRendererTest, DiscsCoverThePixelsWithinTheirRadius) {
  // The third and the fourth have their centers outside of the picture.
  for (const auto& [x, y, radius] : {std::array{30.3f, 20.9f, 7.2f},
                                     {12.1f, 13.9f, 0.4f},
                                     {-20.f, 31.f, 40.f},
                                     {70.f, 80.f, 25.f},
                                     {32.f, 32.f, 20.f}}) {
    const Drawn drawn = draw({{{seen_at(x, y, 4), kRed, radius_of(radius, 4)}}}, discs_plan());
    const double cx = x, cy = y, least = std::max(double{radius}, std::sqrt(0.5));
    EXPECT_EQ(
        wrong_pixels(drawn.picture, {255, 0, 0},
                     [&](double px, double py) { return std::hypot(px - cx, py - cy) <= least; }),
        0)
        << x << ' ' << y << ' ' << radius;
  }
}

TEST_F(GlRendererTest, OrientedSplatsCoverTheDiscInTheirPlane) {
  const glm::dvec3 center(seen_at(36.3f, 24.8f, 5));
  const double radius = radius_of(14, 5);
  for (const glm::dvec3 direction : {glm::dvec3(0.3, -1, 0.2), {1, -0.5, 0}, {0.1, 0.4, 0.7}}) {
    // As the renderer gets it, in steps of 1/511.
    const glm::vec3 normal = unpack_normal(pack_normal(glm::vec3(glm::normalize(direction))));
    const Drawn drawn =
        draw({{{glm::vec3(center), kRed, static_cast<float>(radius), normal}}}, splats_plan());
    const auto covers = [&](double x, double y) {
      const glm::dvec3 q((x - 32) / 32, 1, (32 - y) / 32);
      const double t = glm::dot(center, glm::dvec3(normal)) / glm::dot(q, glm::dvec3(normal));
      const bool holds = std::floor(x) == 36 && std::floor(y) == 24;
      const bool in_square = std::max(std::abs(x - 36.3), std::abs(y - 24.8)) <= 14;
      return holds || (t > 0 && in_square && glm::length(t * q - center) <= radius);
    };
    EXPECT_GT(covered_pixels(drawn.picture), 20u);
    EXPECT_LE(wrong_pixels(drawn.picture, {255, 0, 0}, covers), 1);  // a pixel on the edge
  }
}

double splat_weight(double distance_2) { return (1 - distance_2) * (1 - distance_2); }

TEST_F(GlRendererTest, BlendsSplatsOfOneSurfaceByWeight) {
  constexpr float kRadius = 10;
  const float r = radius_of(kRadius, 2);
  const ScenePoint red{seen_at(28.5f, 32.5f, 2), kRed, r, {0, -1, 0}};
  const ScenePoint blue{seen_at(35.5f, 32.5f, 2), kBlue, r};  // faces the eye anyway
  const ScenePoint hidden{seen_at(32.5f, 32.5f, 4), kGreen, radius_of(60, 4), {0, -1, 0}};
  const Drawn drawn = draw({{hidden, red, blue}}, splats_plan());
  for (std::uint32_t x = 27; x <= 37; ++x) {
    const double to_red = (x + 0.5 - 28.5) / kRadius, to_blue = (x + 0.5 - 35.5) / kRadius;
    const double a = splat_weight(to_red * to_red), b = splat_weight(to_blue * to_blue);
    const auto color = pixel(drawn.picture, x, 32);
    EXPECT_NEAR(color[0], 255 * a / (a + b), 1.01) << x;
    EXPECT_EQ(color[1], 0) << x;
    EXPECT_NEAR(color[2], 255 * b / (a + b), 1.01) << x;
  }
  EXPECT_THAT(pixel(drawn.picture, 2, 2), ElementsAre(0, 255, 0));
}

TEST_F(GlRendererTest, DeferredBlendingJoinsGroupsWithinARadius) {
  // Points 0 and 1 are of different groups; 0 and 4 of one group, in which the nearer wins.
  const float r = radius_of(12, 2);
  const auto at = [&](float depth, std::uint32_t color) {
    return ScenePoint{seen_at(32.5f, 32.5f, depth), color, r, {0, -1, 0}};
  };
  const ScenePoint nothing{{0, -1, 0}};
  FramePlan plan = splats_plan();
  plan.deferred_blending = true;
  // At the center all weights are 1.
  const Drawn joined = draw({{at(2, kRed), at(2.1f, kBlue)}}, plan);
  EXPECT_THAT(pixel(joined.picture, 32, 32), ElementsAre(128, 0, 128));
  const Drawn apart = draw({{at(2, kRed), at(2.9f, kBlue)}}, plan);
  EXPECT_THAT(pixel(apart.picture, 32, 32), ElementsAre(255, 0, 0));
  const Drawn group = draw({{at(2.1f, kBlue), nothing, nothing, nothing, at(2, kRed)}}, plan);
  EXPECT_THAT(pixel(group.picture, 32, 32), ElementsAre(255, 0, 0));
  EXPECT_EQ(pixel(group.picture, 2, 2), kBackgroundPixel);
}

TEST_F(GlRendererTest, DeferredBlendingDrawsEveryPointOfARangeOnce) {
  std::vector<ScenePoint> points;
  for (int i = 0; i < 23; ++i) points.push_back({seen_at(2.5f + 2 * i, 10.5f, 1), kRed, 0.001f});
  make({{points[0]}, points});
  FramePlan plan = splats_plan();
  plan.deferred_blending = true;
  for (std::uint32_t first = 0; first < 6; ++first) {
    const Drawn drawn = draw(
        {view_along_y(kSize),
         plan,
         {{.slot = 1, .first = first, .count = 7}, {.slot = 1, .first = first + 9, .count = 3}}});
    EXPECT_EQ(drawn.statistics.points, 10u);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const bool expected = (i >= first && i < first + 7) || (i >= first + 9 && i < first + 12);
      EXPECT_EQ(pixel(drawn.picture, 2 + 2 * i, 10)[0] == 255, expected) << first << ' ' << i;
    }
  }
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

/// A wall on the left half of the picture, something behind it, and something beside it.
struct WallScene {
  std::vector<std::vector<ScenePoint>> slots = std::vector<std::vector<ScenePoint>>(3);
  Frame frame{view_along_y(kSize), {}, {}};

  explicit WallScene(const FramePlan& plan) {
    frame.plan = plan;
    frame.plan.occlusion_queries = true;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 16; ++x)
        slots[0].push_back(
            {seen_at(1 + 2.0f * x, 1 + 2.0f * y, 2), kRed, radius_of(2, 2), {0, -1, 0}});
    for (int i = 0; i < 10; ++i) {
      slots[1].push_back({seen_at(8.5f + i, 30.5f, 8), kGreen, radius_of(1, 8), {0, -1, 0}});
      slots[2].push_back({seen_at(48.5f + i, 30.5f, 8), kBlue, radius_of(1, 8), {0, -1, 0}});
    }
    for (std::uint32_t slot = 0; slot < 3; ++slot)
      frame.items.push_back({.slot = slot,
                             .count = static_cast<std::uint32_t>(slots[slot].size()),
                             .region = 100 + slot,
                             .probe = slot > 0});
    for (std::uint32_t slot = 1; slot < 3; ++slot) {
      frame.items[slot].box_center =
          (slots[slot].front().position + slots[slot].back().position) / 2.0f;
      frame.items[slot].box_half = {1.2f, 0, 0};  // flat
    }
  }
};

std::vector<bool> seen_of(const DrawStatistics& statistics) {
  std::vector<bool> seen;
  for (std::size_t i = 0; i < statistics.seen.size(); ++i) {
    EXPECT_EQ(statistics.seen[i].region, 100 + i);
    seen.push_back(statistics.seen[i].seen);
  }
  return seen;
}

TEST_F(GlRendererTest, ProbesAreDrawnOnlyWhereTheirBoxIsSeen) {
  FramePlan points = points_plan();
  points.point_pixels = 2;
  for (const FramePlan& plan : {points, discs_plan(), splats_plan()}) {
    WallScene scene(plan);
    make(scene.slots);
    Drawn drawn = draw(scene.frame);
    EXPECT_THAT(seen_of(drawn.statistics), ElementsAre(true, false, true));
    EXPECT_EQ(drawn.statistics.points, 512u + 10u);
    EXPECT_EQ(drawn.statistics.unseen_points, 10u);
    EXPECT_EQ(pixel(drawn.picture, 48, 30)[2], 255);
    // The same with the wall gone: the queries of this frame are not those of the last.
    scene.frame.items[0].count = 0;
    drawn = draw(scene.frame);
    EXPECT_THAT(seen_of(drawn.statistics), ElementsAre(false, true, true));
    EXPECT_EQ(drawn.statistics.unseen_points, 0u);
    EXPECT_EQ(pixel(drawn.picture, 8, 30)[1], 255);
  }
}

TEST_F(GlRendererTest, ItemsThatAreNoProbesAreDrawnAndToldHidden) {
  WallScene scene(discs_plan());
  make(scene.slots);
  for (DrawItem& item : scene.frame.items) item.probe = false;
  const Drawn drawn = draw(scene.frame);
  EXPECT_THAT(seen_of(drawn.statistics), ElementsAre(true, false, true));
  EXPECT_EQ(drawn.statistics.points, 532u);
  EXPECT_EQ(drawn.statistics.unseen_points, 0u);
}

TEST_F(GlRendererTest, AProbeAroundTheEyeOrTheNearPlaneIsSeen) {
  WallScene scene(discs_plan());
  make(scene.slots);
  scene.frame.items[1].box_center = {0, 4, 0};
  scene.frame.items[1].box_half = {1, 4.05f, 1};  // the eye is inside
  EXPECT_THAT(seen_of(draw(scene.frame).statistics), ElementsAre(true, true, true));
  scene.frame.items[1].box_center = {-0.09f, 4, 0};  // before the wall, through the near plane
  scene.frame.items[1].box_half = {0.05f, 3.95f, 0.05f};
  EXPECT_EQ(draw(scene.frame).statistics.unseen_points, 0u);
}

TEST_F(GlRendererTest, AllocatesTargetsOnlyForThePassesOfThePlan) {
  constexpr std::uint64_t kArea = std::uint64_t{kPixels} * kPixels;
  const std::vector<std::vector<ScenePoint>> slots = {{{{0, 1, 0}}}};
  make(slots);
  const auto bytes_after = [&](FramePlan plan, PictureSize size) {
    renderer_->draw({view_along_y(size), plan, {item(0, slots)}});
    return renderer_->target_bytes();
  };
  EXPECT_EQ(renderer_->target_bytes(), 0u);
  FramePlan plan = points_plan();
  EXPECT_EQ(bytes_after(plan, kSize), 8 * kArea);  // color and depth
  plan.eye_dome = plan.occlusion_queries = true;
  EXPECT_EQ(bytes_after(plan, kSize), 8 * kArea);
  EXPECT_EQ(bytes_after(discs_plan(), kSize), 8 * kArea);
  EXPECT_EQ(bytes_after(splats_plan(), kSize), 24 * kArea);
  EXPECT_EQ(bytes_after(splats_plan(), kSize), 24 * kArea);
  EXPECT_EQ(bytes_after(points_plan(), {kPixels, 2 * kPixels}), 16 * kArea);
  plan = splats_plan();
  plan.deferred_blending = true;
  EXPECT_EQ(bytes_after(plan, kSize), (8 + 4 * 12) * kArea);
}

/// Whatever a user may ask for, of datasets with and without normals and colors.
std::vector<FramePlan> all_plans() {
  std::vector<FramePlan> plans;
  for (const Primitive primitive : {Primitive::kPoints, Primitive::kDiscs, Primitive::kSplats})
    for (int i = 0; i < 32; ++i) {
      const auto bit = [&](int which) { return (i >> which & 1) != 0; };
      const SceneFacts scene{.normals = bit(0), .color = bit(1)};
      const Wishes wishes{.primitive = primitive,
                          .eye_dome = bit(2),
                          .occlusion = bit(3),
                          .deferred_blending = bit(4)};
      plans.push_back(plan_frame(scene, {}, wishes, true));
    }
  return plans;
}

TEST_F(GlRendererTest, RunsThePassesThatThePlanNamesOnTheColumnsThatItNeeds) {
  constexpr PictureSize kSmall{16, 16};
  for (const FramePlan& plan : all_plans()) {
    const ColumnSet columns = columns_of(plan);
    NodePoints points = points_of({{{0.01f, 1, 0.01f}, kRed, 0.5f, {0, -1, 0}}});
    if (!columns.radius) points.radius.clear();
    if (!columns.color) points.color.clear();
    if (!columns.normal) points.normal.clear();
    GlRenderer renderer({columns, 1, 1});
    renderer.upload(0, points.columns());
    const DrawStatistics statistics =
        renderer.draw({view_along_y(kSmall), plan, {{.count = 1, .tint = kRed}}});

    const std::vector<std::string> passes = passes_of(plan);
    const auto named = [&](const char* name) {
      return std::find(passes.begin(), passes.end(), name) != passes.end();
    };
    const std::size_t extra = named("visibility") ? 16 : named("splat groups") ? 4 * 12 : 0;
    EXPECT_EQ(renderer.target_bytes(), 16 * 16 * (8 + extra));
    EXPECT_EQ(statistics.seen.size(), named("occlusion queries") ? 1u : 0u);
    EXPECT_THAT(pixel(renderer.picture(), 8, 7), ElementsAre(testing::Gt(250), 0, 0));
  }
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
  // A box whose front face reaches from pixel 16 to 48 at a depth of 2, and whose back face is half as large.
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
