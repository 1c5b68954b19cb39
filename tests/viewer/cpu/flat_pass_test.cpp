#include "viewer/cpu/flat_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/viewer/cpu/drawn_points.h"

namespace cairn::viewer {
namespace {

TEST(FlatPass, DrawsAPointInThePixelThatContainsIt) {
  for (const Place place : {Place{20.3, 11.8}, {0.1, 0.1}, {63.9, 47.9}, {32.0, 24.0}}) {
    const Picture picture =
        drawn({{.position = seen_at(place.x, place.y, 3), .rgb = {1, 2, 3}}}, kPoints);
    EXPECT_EQ(picture.size, kSize);
    EXPECT_EQ(at(picture, static_cast<int>(place.x), static_cast<int>(place.y)), (Rgb{1, 2, 3}));
    expect_covered(picture, [&](int i, int j) {
      return i == static_cast<int>(place.x) && j == static_cast<int>(place.y);
    });
  }
}

TEST(FlatPass, KeepsTheNearestAndOfEquallyNearOnesTheLeastColor) {
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

TEST(FlatPass, LeavesOutWhatIsBehindOrBesideOrNotANumber) {
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

TEST(FlatPass, DrawsADiscOfAnUnusableRadiusAsThePixelThatContainsIt) {
  for (const float radius : {std::numeric_limits<float>::quiet_NaN(), -1.0f, 0.0f})
    for (const FramePlan& plan : {kDiscs, kSplats})
      expect_covered(drawn({{.position = seen_at(20.5, 20.5, 2), .radius = radius}}, plan),
                     [](int x, int y) { return x == 20 && y == 20; });
}

TEST(FlatPass, DrawsASquareOfPixelsWhoseCentersLieInIt) {
  for (const float side : {2.0f, 5.0f, 7.5f, 64.0f})
    for (const Place place : {Place{20.3, 11.8}, {1.2, 46.9}, {-1.6, 20.2}, {32, 24}}) {
      FramePlan plan = kPoints;
      plan.point_pixels = side;
      const auto within = [&](double center, double middle) {
        return center >= middle - side / 2 && center < middle + side / 2;
      };
      expect_covered(drawn({{.position = seen_at(place.x, place.y, 2)}}, plan), [&](int i, int j) {
        return within(i + 0.5, place.x) && within(j + 0.5, place.y);
      });
    }
}

TEST(FlatPass, DrawsADiscOfPixelsWhoseCentersLieInIt) {
  for (const double pixels : {0.3, 0.9, 3.7, 11.2})
    for (const Place place : {Place{20.3, 11.8}, {0.95, 46.9}, {-1.6, 20.2}}) {
      const double depth = 3;
      const auto radius = static_cast<float>(pixels * depth / kFocal);
      const double drawn_radius = std::max(pixels, std::sqrt(0.5));
      expect_covered(
          drawn({{.position = seen_at(place.x, place.y, depth), .radius = radius}}, kDiscs),
          [&](int i, int j) {
            return std::hypot(i + 0.5 - place.x, j + 0.5 - place.y) <= drawn_radius ||
                   (i == std::floor(place.x) && j == std::floor(place.y));
          });
    }
}

// Four centers are then as far away as the smallest radius, but for rounding.
TEST(FlatPass, DrawsTheSmallestDiscOnAPixelsCornerInThatPixel) {
  EXPECT_NE(at(drawn({{.position = seen_at(32, 24, 2)}}, kDiscs), 32, 24), kBackground);
}

TEST(FlatPass, DrawsNoDiscLargerThanTheLargest) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  const PictureSize size{400, 300};
  // Of 90 degrees over 300 rows the focal length is 150 pixels; the point lies in the middle.
  renderer.upload(0, node_of({{.position = {2, 0, 0}, .radius = 1e6f}}).columns());
  renderer.draw({.view = view(size), .plan = kDiscs, .items = {{.slot = 0, .count = 1}}});
  expect_covered(renderer.picture(), [&](int x, int y) {
    return std::hypot(x + 0.5 - 200, y + 0.5 - 150) <= shading::kMaxPixelRadius;
  });
}

}  // namespace
}  // namespace cairn::viewer
