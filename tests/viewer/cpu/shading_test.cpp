#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/viewer/cpu/drawn_points.h"

namespace cairn::viewer {
namespace {

TEST(Shading, LeavesOutBackFacesOnlyIfAsked) {
  const std::vector<Point> points{
      {seen_at(10.5, 20.5, 2), {1, 1, 1}, 0, {-1, 0, 0}},
      {seen_at(20.5, 20.5, 2), {1, 1, 1}, 0, {1, 0, 0}},
      {seen_at(30.5, 20.5, 2), {1, 1, 1}, 0, {0, 0, 0}},
  };
  for (FramePlan plan : {kPoints, kDiscs, kSplats})
    for (const bool cull : {false, true}) {
      plan.cull_back_faces = cull;
      expect_covered(drawn(points, plan), [&](int x, int y) {
        return y == 20 && (x == 10 || x == 30 || (x == 20 && !cull));
      });
    }
}

TEST(Shading, LightsByTheAngleOfNormalAndSight) {
  FramePlan plan = kPoints;
  plan.lighting = true;
  for (const glm::vec3& direction : {glm::vec3(-1, 0, 0), glm::vec3(1, 1, 0),
                                     glm::vec3(0.2f, -0.4f, 0.9f), glm::vec3(0, 1, 1)}) {
    const glm::vec3 p = seen_at(12.5, 40.5, 3);
    const glm::vec3 n = unpack_normal(pack_normal(glm::normalize(direction)));
    const double factor = 0.25 + 0.75 * std::abs(glm::dot(n, p)) / glm::length(p);
    const Rgb rgb = at(drawn({{p, {250, 120, 30}, 0, n}}, plan), 12, 40);
    EXPECT_NEAR(rgb[0], 250 * factor, 0.51);
    EXPECT_NEAR(rgb[1], 120 * factor, 0.51);
    EXPECT_NEAR(rgb[2], 30 * factor, 0.51);
  }
  EXPECT_EQ(at(drawn({{seen_at(12.5, 40.5, 3), {250, 120, 30}, 0, {0, 0, 0}}}, plan), 12, 40),
            (Rgb{250, 120, 30}))
      << "without a normal";
}

TEST(Shading, TintsWithLightWhereTheColorIsNotAPointsOwn) {
  FramePlan plan = kPoints;
  plan.lighting = true;
  for (const ColorSource source : {ColorSource::kPlain, ColorSource::kLevel, ColorSource::kError}) {
    plan.color = source;
    const Picture picture =
        drawn({{seen_at(32, 24, 2), {1, 1, 1}, 0, {0, 1, 0}}}, plan, packed({200, 100, 40}));
    EXPECT_EQ(at(picture, 32, 24), (Rgb{50, 25, 10})) << "seen along its surface: ambient light";
  }
}

/// Points that fill the picture, a point a pixel, at depths by column.
template <typename Depth>
Picture drawn_wall(bool eye_dome, const Depth& depth) {
  std::vector<Point> points;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      points.push_back({.position = seen_at(x + 0.5, y + 0.5, depth(x)), .rgb = {200, 100, 50}});
  FramePlan plan = kPoints;
  plan.eye_dome = eye_dome;
  return drawn(points, plan);
}

TEST(Shading, EyeDomeLightingDarkensAStepAndLeavesAPlaneAlone) {
  EXPECT_EQ(drawn_wall(true, [](int) { return 4.0; }), drawn_wall(false, [](int) { return 4.0; }));
  const Picture step = drawn_wall(true, [](int x) { return x < 30 ? 4.0 : 4.1; });
  for (int y = 2; y < 46; ++y)
    for (int x = 2; x < 62; ++x) {
      // Three of eight neighbors are nearer in the two columns behind the step.
      const double response = x == 30 || x == 31 ? 3 * std::log2(4.1 / 4.0) / 8 : 0;
      EXPECT_NEAR(at(step, x, y)[0], 200 * std::exp(-30 * response), 0.6) << x << ", " << y;
    }
  for (int y : {0, 1, 47})
    EXPECT_NEAR(at(step, 30, y)[0], 200 * std::exp(-30 * 2 * std::log2(4.1 / 4.0) / 8), 0.6)
        << "beside the picture is background";
}

TEST(Shading, EyeDomeLightingKnowsNoNeighborBeforeTheBackground) {
  for (FramePlan plan : {kPoints, kSplats}) {
    plan.eye_dome = true;
    const Picture picture = drawn({{.position = seen_at(20.5, 20.5, 2), .rgb = {9, 8, 7}}}, plan);
    EXPECT_EQ(at(picture, 20, 20), (Rgb{9, 8, 7}));
    expect_covered(picture, [](int x, int y) { return x == 20 && y == 20; });
  }
}

}  // namespace
}  // namespace cairn::viewer
