#include "viewer/gl/occlusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/viewer/gl_fixture.h"

namespace cairn::viewer::tests {
namespace {

using testing::ElementsAre;

using GlOcclusion = GlRendererTest;

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

TEST_F(GlOcclusion, ProbesAreDrawnOnlyWhereTheirBoxIsSeen) {
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

TEST_F(GlOcclusion, ItemsThatAreNoProbesAreDrawnAndToldHidden) {
  WallScene scene(discs_plan());
  make(scene.slots);
  for (DrawItem& item : scene.frame.items) item.probe = false;
  const Drawn drawn = draw(scene.frame);
  EXPECT_THAT(seen_of(drawn.statistics), ElementsAre(true, false, true));
  EXPECT_EQ(drawn.statistics.points, 532u);
  EXPECT_EQ(drawn.statistics.unseen_points, 0u);
}

TEST_F(GlOcclusion, AProbeAroundTheEyeOrTheNearPlaneIsSeen) {
  WallScene scene(discs_plan());
  make(scene.slots);
  scene.frame.items[1].box_center = {0, 4, 0};
  scene.frame.items[1].box_half = {1, 4.05f, 1};  // the eye is inside
  EXPECT_THAT(seen_of(draw(scene.frame).statistics), ElementsAre(true, true, true));
  scene.frame.items[1].box_center = {-0.09f, 4, 0};  // before the wall, through the near plane
  scene.frame.items[1].box_half = {0.05f, 3.95f, 0.05f};
  EXPECT_EQ(draw(scene.frame).statistics.unseen_points, 0u);
}

}  // namespace
}  // namespace cairn::viewer::tests
