#include "viewer/cpu/cpu_renderer.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

constexpr PictureSize kSize{64, 48};
constexpr ColumnSet kAll{.radius = true, .color = true, .normal = true};
using Rgb = std::array<int, 3>;
constexpr Rgb kBackground{shading::kBackground[0], shading::kBackground[1],
                          shading::kBackground[2]};

std::uint32_t packed(const Rgb& rgb) {
  return static_cast<std::uint32_t>(rgb[0] | rgb[1] << 8 | rgb[2] << 16) | 0xff000000;
}

Rgb at(const Picture& picture, int x, int y) {
  const std::size_t i = 3 * (static_cast<std::size_t>(y) * picture.size.width + x);
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

/// Looks along x with z up: to the right is -y. Of 90 degrees over 48 rows: the focal length is 24 pixels.
constexpr double kFocal = 24;
View view(PictureSize size = kSize) {
  return {{.eye = {0, 0, 0}, .target = {1, 0, 0}, .up = {0, 0, 1}, .fov_y_degrees = 90}, size, 0.5};
}

/// The point that appears at a place of the picture, at a depth.
glm::vec3 seen_at(double x, double y, double depth, PictureSize size = kSize) {
  return {depth, (size.width / 2.0 - x) * depth / kFocal, (size.height / 2.0 - y) * depth / kFocal};
}

struct Point {
  glm::vec3 position{0, 0, 0};
  Rgb rgb{255, 255, 255};
  float radius = 0;
  glm::vec3 normal{0, 0, 0};
};

NodePoints node_of(const std::vector<Point>& points) {
  NodePoints node;
  for (const Point& point : points) {
    node.position.push_back(point.position);
    node.radius.push_back(point.radius);
    node.color.push_back(packed(point.rgb));
    node.normal.push_back(pack_normal(point.normal));
  }
  return node;
}

constexpr FramePlan kPoints{.primitive = Primitive::kPoints, .color = ColorSource::kColor};
constexpr FramePlan kDiscs{.primitive = Primitive::kDiscs, .color = ColorSource::kColor};
constexpr FramePlan kSplats{
    .primitive = Primitive::kSplats, .color = ColorSource::kColor, .oriented = true};

Picture drawn(const std::vector<Point>& points, const FramePlan& plan, std::uint32_t tint = 0) {
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

TEST(CpuRenderer, DrawsAPointInThePixelThatContainsIt) {
  for (const auto& [x, y] : {std::pair{20.3, 11.8}, {0.1, 0.1}, {63.9, 47.9}, {32.0, 24.0}}) {
    const Picture picture = drawn({{.position = seen_at(x, y, 3), .rgb = {1, 2, 3}}}, kPoints);
    EXPECT_EQ(picture.size, kSize);
    EXPECT_EQ(at(picture, static_cast<int>(x), static_cast<int>(y)), (Rgb{1, 2, 3}));
    expect_covered(picture, [&](int i, int j) {
      return i == static_cast<int>(x) && j == static_cast<int>(y);
    });
  }
}

TEST(CpuRenderer, PlacesAnItemByItsOffsetAndRange) {
  CpuRenderer renderer({.columns = {}, .slots = 3, .slot_points = 4});
  const std::vector<glm::vec3> positions(4, seen_at(10.5, 9.5, 2));
  renderer.upload(2, {.position = positions, .radius = {}, .color = {}, .normal = {}});
  const glm::vec3 offset = seen_at(40.5, 30.5, 2) - seen_at(10.5, 9.5, 2);
  FramePlan plan;
  plan.color = ColorSource::kLevel;
  const DrawStatistics statistics = renderer.draw(
      {.view = view(),
       .plan = plan,
       .items = {{.slot = 2, .first = 1, .count = 2, .offset = offset, .tint = 0x00030201}}});
  EXPECT_EQ(statistics.points, 2u);
  EXPECT_EQ(at(renderer.picture(), 40, 30), (Rgb{1, 2, 3}));
  expect_covered(renderer.picture(), [](int x, int y) { return x == 40 && y == 30; });
}

TEST(CpuRenderer, KeepsTheNearestAndOfEquallyNearOnesTheLeastColor) {
  const auto point = [](double depth, Rgb rgb) {
    return Point{.position = seen_at(20.5, 20.5, depth), .rgb = rgb, .radius = 0.2f};
  };
  for (const FramePlan& plan : {kPoints, kDiscs}) {
    EXPECT_EQ(
        at(drawn({point(4, {9, 9, 9}), point(2, {5, 6, 7}), point(3, {8, 8, 8})}, plan), 20, 20),
        (Rgb{5, 6, 7}));
    EXPECT_EQ(at(drawn({point(2, {5, 6, 7}), point(2, {4, 6, 7})}, plan), 20, 20), (Rgb{4, 6, 7}));
  }
}

TEST(CpuRenderer, LeavesOutWhatIsBehindOrBesideOrNotANumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  std::vector<Point> points;
  for (const glm::vec3& position :
       {glm::vec3(-3, 0, 0), glm::vec3(0, 0, 0), glm::vec3(0.49f, 0, 0), seen_at(-200, 20, 2),
        seen_at(300, 20, 2), seen_at(20, 300, 2), seen_at(20, -300, 2), glm::vec3(nan, 0, 0),
        glm::vec3(1, nan, 0), glm::vec3(1, 0, nan), glm::vec3(infinite, 0, 0),
        glm::vec3(1, infinite, 0), glm::vec3(1e38f, 3e38f, 0)})
    for (const float radius : {0.1f, nan})
      points.push_back({.position = position, .radius = radius, .normal = {0, 0, 1}});
  FramePlan wide = kPoints;
  wide.point_pixels = 64;
  for (FramePlan plan : {kPoints, wide, kDiscs, kSplats}) {
    plan.lighting = true;
    expect_covered(drawn(points, plan), [](int, int) { return false; });
  }
}

TEST(CpuRenderer, DrawsADiscOfAnUnusableRadiusAsThePixelThatContainsIt) {
  for (const float radius : {std::numeric_limits<float>::quiet_NaN(), -1.0f, 0.0f})
    for (const FramePlan& plan : {kDiscs, kSplats})
      expect_covered(drawn({{.position = seen_at(20.5, 20.5, 2), .radius = radius}}, plan),
                     [](int x, int y) { return x == 20 && y == 20; });
}

TEST(CpuRenderer, DrawsASquareOfPixelsWhoseCentersLieInIt) {
  for (const float side : {2.0f, 5.0f, 7.5f, 64.0f})
    for (const auto& [x, y] : {std::pair{20.3, 11.8}, {1.2, 46.9}, {-1.6, 20.2}}) {
      FramePlan plan = kPoints;
      plan.point_pixels = side;
      const auto within = [&](double center, double middle) {
        return center >= middle - side / 2 && center < middle + side / 2;
      };
      expect_covered(drawn({{.position = seen_at(x, y, 2)}}, plan),
                     [&](int i, int j) { return within(i + 0.5, x) && within(j + 0.5, y); });
    }
}

TEST(CpuRenderer, DrawsADiscOfPixelsWhoseCentersLieInIt) {
  for (const double pixels : {0.3, 0.9, 3.7, 11.2})
    for (const auto& [x, y] : {std::pair{20.3, 11.8}, {0.95, 46.9}, {-1.6, 20.2}}) {
      const double depth = 3;
      const auto radius = static_cast<float>(pixels * depth / kFocal);
      const double drawn_radius = std::max(pixels, std::sqrt(0.5));
      expect_covered(drawn({{.position = seen_at(x, y, depth), .radius = radius}}, kDiscs),
                     [&](int i, int j) {
                       return std::hypot(i + 0.5 - x, j + 0.5 - y) <= drawn_radius ||
                              (i == std::floor(x) && j == std::floor(y));
                     });
    }
}

TEST(CpuRenderer, DrawsNoDiscLargerThanTheLargest) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  const PictureSize size{400, 300};
  // Of 90 degrees over 300 rows the focal length is 150 pixels; the point lies in the middle.
  renderer.upload(0, node_of({{.position = {2, 0, 0}, .radius = 1e6f}}).columns());
  renderer.draw({.view = view(size), .plan = kDiscs, .items = {{.slot = 0, .count = 1}}});
  expect_covered(renderer.picture(), [&](int x, int y) {
    return std::hypot(x + 0.5 - 200, y + 0.5 - 150) <= shading::kMaxPixelRadius;
  });
}

// A disc of radius r around p with normal n holds what lies in its plane within r: the line of sight q meets the plane at
// t q with t = n . p / n . q.
TEST(CpuRenderer, DrawsASplatAsTheEllipseOfATiltedDisc) {
  for (const glm::dvec3& tilt : {glm::dvec3(-1, 0, 0), glm::dvec3(-1, 0.8, -0.5),
                                 glm::dvec3(0.3, 1, 0.4), glm::dvec3(0.05, -0.1, 1)}) {
    const glm::dvec3 normal(unpack_normal(pack_normal(glm::normalize(glm::vec3(tilt)))));
    const double x = 30.2, y = 22.9, depth = 4, radius = 1.5;
    const glm::dvec3 p(seen_at(x, y, depth));
    const double pixels = radius * kFocal / depth;
    int covered = 0;
    expect_covered(
        drawn({{.position = glm::vec3(p), .radius = 1.5f, .normal = glm::vec3(normal)}}, kSplats),
        [&](int i, int j) {
          const glm::dvec3 q(1, (32 - (i + 0.5)) / kFocal, (24 - (j + 0.5)) / kFocal);
          const double t = glm::dot(normal, p) / glm::dot(normal, q);
          const bool inside = t > 0.5 && glm::length(t * q - p) <= radius &&
                              std::abs(i + 0.5 - x) <= pixels && std::abs(j + 0.5 - y) <= pixels;
          covered += inside;
          return inside || (i == 30 && j == 22);
        });
    EXPECT_GT(covered, 10);
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
TEST(CpuRenderer, BlendsSplatsOfOneSurfaceByWeight) {
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

TEST(CpuRenderer, BlendsNoSplatThatLiesBehindTheSurface) {
  const auto splat = [](double depth, Rgb rgb) {
    return Point{seen_at(20.5, 20.5, depth), rgb, 0.25f, {-1, 0, 0}};
  };
  // The surface reaches a radius behind the nearer one, and no farther.
  EXPECT_EQ(at(drawn({splat(2, {200, 0, 0}), splat(2.26, {0, 200, 0})}, kSplats), 20, 20),
            (Rgb{200, 0, 0}));
  EXPECT_EQ(at(drawn({splat(2, {200, 0, 0}), splat(2.24, {0, 200, 0})}, kSplats), 20, 20),
            (Rgb{100, 100, 0}));
}

TEST(CpuRenderer, SumsManySplatsInOnePixelExactly) {
  std::vector<Point> points(300000, {seen_at(20.5, 20.5, 2), {255, 255, 255}, 0, {0, 0, 0}});
  for (std::size_t i = 0; i < points.size(); i += 2) points[i].rgb = {55, 155, 255};
  EXPECT_EQ(at(drawn(points, kSplats), 20, 20), (Rgb{155, 205, 255}));
}

TEST(CpuRenderer, LeavesOutBackFacesOnlyIfAsked) {
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

TEST(CpuRenderer, LightsByTheAngleOfNormalAndSight) {
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

TEST(CpuRenderer, TintsWithLightWhereTheColorIsNotAPointsOwn) {
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

TEST(CpuRenderer, EyeDomeLightingDarkensAStepAndLeavesAPlaneAlone) {
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

TEST(CpuRenderer, EyeDomeLightingKnowsNoNeighborBeforeTheBackground) {
  for (FramePlan plan : {kPoints, kSplats}) {
    plan.eye_dome = true;
    const Picture picture = drawn({{.position = seen_at(20.5, 20.5, 2), .rgb = {9, 8, 7}}}, plan);
    EXPECT_EQ(at(picture, 20, 20), (Rgb{9, 8, 7}));
    expect_covered(picture, [](int x, int y) { return x == 20 && y == 20; });
  }
}

/// Random points in several slots, many in front of others.
class CpuRendererOrder : public testing::TestWithParam<FramePlan> {
 protected:
  CpuRendererOrder() {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      std::vector<Point> points;
      for (int i = 0; i < 5000; ++i)
        points.push_back(
            {.position = {unit(random), unit(random), unit(random)},
             .rgb = {static_cast<int>(random() % 256), static_cast<int>(random() % 256),
                     static_cast<int>(random() % 256)},
             .radius = 0.05f + 0.05f * unit(random),
             .normal = {unit(random), unit(random), unit(random)}});
      renderer_.upload(slot, node_of(points).columns());
      items_.push_back({.slot = slot, .count = 5000, .offset = {3 + 0.1f * slot, 0, 0}});
    }
  }

  Picture drawn_by(int threads) {
    tbb::task_arena arena(threads);
    arena.execute([&] { renderer_.draw({.view = view(), .plan = GetParam(), .items = items_}); });
    return renderer_.picture();
  }

  static constexpr std::uint32_t kSlots = 12;
  CpuRenderer renderer_{{.columns = kAll, .slots = kSlots, .slot_points = 5000}};
  std::vector<DrawItem> items_;
};

TEST_P(CpuRendererOrder, NeitherThreadsNorTheOrderOfItemsChangeThePicture) {
  const Picture first = drawn_by(1);
  std::mt19937 random(3);
  for (const int threads : {1, 2, 7}) {
    EXPECT_TRUE(drawn_by(threads) == first) << threads << " threads";
    std::shuffle(items_.begin(), items_.end(), random);
    EXPECT_TRUE(drawn_by(threads) == first) << threads << " threads, shuffled";
  }
  // Cut into pieces, points stand elsewhere in their batches.
  std::vector<DrawItem> pieces;
  for (const DrawItem& item : items_)
    for (const auto& [begin, end] : {std::pair{0u, 1u}, {1u, 778u}, {778u, 5000u}}) {
      pieces.push_back(item);
      pieces.back().first = begin;
      pieces.back().count = end - begin;
    }
  items_ = pieces;
  EXPECT_TRUE(drawn_by(2) == first) << "in pieces";
}

FramePlan with_all_effects(FramePlan plan) {
  plan.lighting = plan.cull_back_faces = plan.eye_dome = true;
  return plan;
}
FramePlan wide_points() {
  FramePlan plan = kPoints;
  plan.point_pixels = 3;
  return plan;
}

INSTANTIATE_TEST_SUITE_P(Plans, CpuRendererOrder,
                         testing::Values(kPoints, wide_points(), kDiscs, kSplats,
                                         with_all_effects(kPoints), with_all_effects(kDiscs),
                                         with_all_effects(kSplats)));

TEST(CpuRenderer, AllocatesSumsOnlyOnceSplatsAreDrawn) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2)}}).columns());
  EXPECT_EQ(renderer.buffer_bytes(), 0u);
  constexpr std::size_t kPixels = std::size_t{kSize.width} * kSize.height;
  for (FramePlan plan : {kPoints, kDiscs, with_all_effects(kDiscs)}) {
    renderer.draw({.view = view(), .plan = plan, .items = {{.slot = 0, .count = 1}}});
    EXPECT_EQ(renderer.buffer_bytes(), (8 + 3) * kPixels) << "a word and a color a pixel";
  }
  renderer.draw({.view = view(), .plan = kSplats, .items = {{.slot = 0, .count = 1}}});
  EXPECT_EQ(renderer.buffer_bytes(), (8 + 3 + 32) * kPixels);
}

TEST(CpuRenderer, BeginsEachFrameAnewInAnySize) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  EXPECT_EQ(renderer.picture(), Picture{});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2), .radius = 0.5f}}).columns());
  for (const FramePlan& plan : {kSplats, kPoints, kSplats})
    for (const PictureSize size : {PictureSize{80, 48}, kSize, PictureSize{16, 8}}) {
      renderer.draw({.view = view(size), .plan = plan, .items = {{.slot = 0, .count = 1}}});
      renderer.draw({.view = view(size), .plan = plan, .items = {}});
      EXPECT_EQ(renderer.picture().size, size);
      expect_covered(renderer.picture(), [](int, int) { return false; });
    }
}

TEST(CpuRenderer, DrawsProbesAsOtherItems) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2)}}).columns());
  FramePlan plan = kPoints;
  plan.occlusion_queries = true;
  const DrawStatistics statistics = renderer.draw(
      {.view = view(), .plan = plan, .items = {{.slot = 0, .count = 1, .probe = true}}});
  EXPECT_EQ(statistics.points, 1u);
  EXPECT_TRUE(statistics.seen.empty());
  EXPECT_EQ(at(renderer.picture(), 20, 20), (Rgb{255, 255, 255}));
}

TEST(CpuRenderer, RefusesItemsAndPlansThatItHasNotThePointsFor) {
  CpuRenderer renderer({.columns = {.radius = true}, .slots = 2, .slot_points = 4});
  const std::vector<glm::vec3> positions(3);
  const std::vector<float> radii(3);
  renderer.upload(1, {.position = positions, .radius = radii, .color = {}, .normal = {}});
  FramePlan plain;
  for (const DrawItem& item :
       {DrawItem{.slot = 2, .count = 1}, DrawItem{.slot = 0, .count = 1},
        DrawItem{.slot = 1, .first = 2, .count = 2}, DrawItem{.slot = 1, .first = 4, .count = 0}})
    EXPECT_THROW(renderer.draw({.view = view(), .plan = plain, .items = {item}}), formats::Error);
  EXPECT_THROW(renderer.draw({.view = view(), .plan = kPoints, .items = {}}), formats::Error);
  EXPECT_THROW(renderer.upload(2, {}), formats::Error);
  EXPECT_THROW(renderer.upload(0, {.position = positions, .radius = {}, .color = {}, .normal = {}}),
               formats::Error);
}

TEST(CpuRenderer, TakesNoMemoryForSlotsThatAreEmpty) {
  try {
    // 24 TB and more, of which nothing is touched, or a refusal that says how many.
    const CpuRenderer renderer({.columns = kAll, .slots = 1u << 20, .slot_points = 1u << 20});
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("1048576 nodes"), std::string::npos);
  }
}

}  // namespace
}  // namespace cairn::viewer
