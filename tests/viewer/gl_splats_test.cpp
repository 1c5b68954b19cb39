// What discs and splats cover, and how they blend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/viewer/gl_fixture.h"

namespace cairn::viewer::tests {
namespace {

using testing::ElementsAre;

using GlSplats = GlRendererTest;

/// Counts pixels where the picture is not `color` although the test says so, or the other way
/// round.
template <typename Covers>
int wrong_pixels(const Picture& picture, std::array<int, 3> color, Covers covers) {
  int wrong = 0;
  for (std::uint32_t y = 0; y < picture.size.height; ++y)
    for (std::uint32_t x = 0; x < picture.size.width; ++x)
      wrong += (pixel(picture, x, y) == color) != covers(x + 0.5, y + 0.5) ? 1 : 0;
  return wrong;
}

TEST_F(GlSplats, DiscsCoverThePixelsWithinTheirRadius) {
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

TEST_F(GlSplats, OrientedSplatsCoverTheDiscInTheirPlane) {
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

TEST_F(GlSplats, BlendsSplatsOfOneSurfaceByWeight) {
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

TEST_F(GlSplats, DeferredBlendingJoinsGroupsWithinARadius) {
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

TEST_F(GlSplats, DeferredBlendingDrawsEveryPointOfARangeOnce) {
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

}  // namespace
}  // namespace cairn::viewer::tests
