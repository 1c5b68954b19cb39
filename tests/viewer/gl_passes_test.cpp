// What a frame runs and allocates is what its plan names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/viewer/gl_fixture.h"

namespace cairn::viewer::tests {
namespace {

using testing::ElementsAre;

using GlPasses = GlRendererTest;

TEST_F(GlPasses, AllocatesTargetsOnlyForThePassesOfThePlan) {
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

TEST_F(GlPasses, RunsThePassesThatThePlanNamesOnTheColumnsThatItNeeds) {
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

}  // namespace
}  // namespace cairn::viewer::tests
