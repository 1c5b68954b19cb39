#include "viewer/cpu/splat_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/viewer/cpu/drawn_points.h"

namespace cairn::viewer {
namespace {

// A disc of radius r around p with normal n holds what lies in its plane within r: the line of sight q meets the plane at
// t q with t = n . p / n . q.
TEST(SplatPass, DrawsASplatAsTheEllipseOfATiltedDisc) {
  struct Disc {
    glm::vec3 tilt;
    double depth = 4;
    float radius = 1.5f;
  };
  for (const Disc& disc :
       {Disc{{-1, 0, 0}}, Disc{{-1, 0.8f, -0.5f}}, Disc{{0.3f, 1, 0.4f}}, Disc{{0.05f, -0.1f, 1}},
        Disc{.tilt = {-0.5f, 0.6f, 0.9f}, .depth = 0.7, .radius = 0.6f}}) {
    const glm::dvec3 normal(unpack_normal(pack_normal(glm::normalize(disc.tilt))));
    const double x = 30.2, y = 22.9;
    const glm::dvec3 p(seen_at(x, y, disc.depth));
    const double pixels = disc.radius * kFocal / disc.depth;
    int covered = 0;
    int too_near = 0;
    const auto inside = [&](int i, int j) {
      const glm::dvec3 q(1, (32 - (i + 0.5)) / kFocal, (24 - (j + 0.5)) / kFocal);
      const double t = glm::dot(normal, p) / glm::dot(normal, q);
      if (glm::length(t * q - p) > disc.radius || std::abs(i + 0.5 - x) > pixels ||
          std::abs(j + 0.5 - y) > pixels)
        return i == 30 && j == 22;
      ++(t > kNear ? covered : too_near);
      return t > kNear;
    };
    const Point point{.position = p, .radius = disc.radius, .normal = normal};
    expect_covered(drawn({point}, kSplats), inside);
    EXPECT_GT(covered, 10);
    EXPECT_EQ(too_near > 0, disc.depth < 1) << "the near plane cuts through the last alone";
  }
}

Picture drawn_blend(const std::vector<Point>& points, bool oriented) {
  FramePlan plan = kSplats;
  plan.oriented = oriented;
  return drawn(points, plan);
}

/// (1 - d^2)^2 with d the distance of a pixel's center over the radius, both in pixels.
double weight(double x, double y, int i, int j, double radius) {
  if (i == std::floor(x) && j == std::floor(y)) return 1;
  const double d = std::hypot(i + 0.5 - x, j + 0.5 - y) / radius;
  return d > 1 ? 0 : (1 - d * d) * (1 - d * d);
}

// In a plane straight before the eye, distances in the surface are distances in the picture.
TEST(SplatPass, BlendsSplatsOfOneSurfaceByWeight) {
  const double depth = 2, pixels = 8;
  const auto radius = static_cast<float>(pixels * depth / kFocal);
  const std::vector<Point> points{{seen_at(20.4, 20.3, depth), {200, 10, 0}, radius, {-1, 0, 0}},
                                  {seen_at(25.1, 22.6, depth), {0, 110, 250}, radius, {1, 0, 0}}};
  for (const bool oriented : {true, false}) {
    const Picture picture = drawn_blend(points, oriented);
    int both = 0;
    for (int j = 0; j < 48; ++j)
      for (int i = 0; i < 64; ++i) {
        const double a = weight(20.4, 20.3, i, j, pixels);
        const double b = weight(25.1, 22.6, i, j, pixels);
        // Where weights are next to nothing, their fixed steps show.
        if (a + b < 0.001) continue;
        both += a > 0 && b > 0;
        const Rgb rgb = at(picture, i, j);
        EXPECT_NEAR(rgb[0], 200 * a / (a + b), 1) << i << ", " << j;
        EXPECT_NEAR(rgb[1], (10 * a + 110 * b) / (a + b), 1) << i << ", " << j;
        EXPECT_NEAR(rgb[2], 250 * b / (a + b), 1) << i << ", " << j;
      }
    EXPECT_GT(both, 50);
  }
}

TEST(SplatPass, BlendsNoSplatThatLiesBehindTheSurface) {
  const auto splat = [](double depth, Rgb rgb) {
    return Point{seen_at(20.5, 20.5, depth), rgb, 0.25f, {-1, 0, 0}};
  };
  // The surface reaches a radius behind the nearer one, and no farther.
  EXPECT_EQ(at(drawn({splat(2, {200, 0, 0}), splat(2.26, {0, 200, 0})}, kSplats), 20, 20),
            (Rgb{200, 0, 0}));
  EXPECT_EQ(at(drawn({splat(2, {200, 0, 0}), splat(2.24, {0, 200, 0})}, kSplats), 20, 20),
            (Rgb{100, 100, 0}));
}

// All means lie between two numbers: one splat lost, or added twice, shows. So many that two threads meet.
TEST(SplatPass, SumsManySplatsInOnePixelExactly) {
  std::vector<Point> points(100000, {seen_at(20.5, 20.5, 2), {100, 51, 8}});
  for (std::size_t i = 0; i < points.size(); i += 2) points[i].rgb = {101, 52, 7};
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 100000});
  renderer.upload(0, node_of(points).columns());
  const std::vector<DrawItem> items(40, {.slot = 0, .count = 100000});
  renderer.draw({.view = view(), .plan = kSplats, .items = items});
  EXPECT_EQ(at(renderer.picture(), 20, 20), (Rgb{101, 52, 8}));
}

}  // namespace
}  // namespace cairn::viewer
