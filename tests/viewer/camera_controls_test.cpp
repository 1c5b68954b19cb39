// Camera controls, by the formulas that they promise.
#include "viewer/camera_controls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace cairn::viewer {
namespace {

constexpr PictureSize kSize{800, 600};
constexpr double kPi = std::numbers::pi;

double distance_of(const Camera& camera) { return glm::distance(camera.eye, camera.target); }

glm::dvec3 sight_of(const Camera& camera) { return glm::normalize(camera.target - camera.eye); }

/// Angle between the line of sight and the up direction.
double pole_angle(const Camera& camera) {
  return std::acos(glm::dot(sight_of(camera), glm::normalize(camera.up)));
}

/// Cameras near the origin, on a national grid and at the Earth's surface, some with a tilted up direction.
std::vector<Camera> cameras() {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return glm::dvec3(normal(random), normal(random), normal(random)); };
  std::vector<Camera> all;
  for (const glm::dvec3& origin :
       {glm::dvec3(0, 0, 0), glm::dvec3(637000, 851000, 400), glm::dvec3(4.2e6, 1.7e5, 4.78e6)})
    for (int i = 0; i < 20; ++i)
      all.push_back({.eye = origin + 50.0 * vector(),
                     .target = origin + 5.0 * vector(),
                     .up = i % 2 == 0 ? glm::dvec3(0, 0, 1) : 3.0 * vector(),
                     .fov_y_degrees = 20.0 + 4 * i});
  return all;
}

TEST(CameraControls, OrbitingKeepsDistanceTargetAndFieldOfView) {
  for (const Camera& camera : cameras()) {
    const Camera moved = orbited(camera, {123, -45}, kSize);
    EXPECT_NEAR(distance_of(moved), distance_of(camera), 1e-8);
    EXPECT_NE(moved.eye, camera.eye);
    EXPECT_EQ(moved.target, camera.target);
    EXPECT_EQ(moved.up, camera.up);
    EXPECT_EQ(moved.fov_y_degrees, camera.fov_y_degrees);
  }
}

TEST(CameraControls, TwoPictureHeightsOrbitOnceAround) {
  for (const Camera& camera : cameras()) {
    const Camera half = orbited(camera, {600, 0}, kSize);
    const glm::dvec3 up = glm::normalize(camera.up);
    const glm::dvec3 from = camera.eye - camera.target, opposite = half.eye - half.target;
    EXPECT_NEAR(glm::dot(from, up), glm::dot(opposite, up), 1e-7);  // as high,
    EXPECT_LT(glm::length(glm::cross(from + opposite, up)), 1e-7);  // on the other side
    Camera moved = camera;
    for (int i = 0; i < 60; ++i) moved = orbited(moved, {20, 0}, kSize);
    EXPECT_LT(glm::distance(moved.eye, camera.eye), 1e-6);
  }
}

TEST(CameraControls, OrbitingDragsTheSceneAlong) {
  // From the south: the scene's front turns to the right (east), so the eye goes west; and down, so the eye rises.
  const Camera camera{.eye = {0, -10, 0}};
  const Camera right = orbited(camera, {300, 0}, kSize);
  EXPECT_LT(glm::distance(right.eye, glm::dvec3(-10, 0, 0)), 1e-12);
  const Camera down = orbited(camera, {0, 150}, kSize);
  EXPECT_LT(glm::distance(down.eye, 10.0 * glm::dvec3(0, -std::sqrt(0.5), std::sqrt(0.5))), 1e-12);
  // What lies before the target moves in the picture as the mouse does.
  const glm::dvec3 front(0, -1, 0);
  const View before(camera, kSize, 0.1), after(orbited(camera, {3, 2}, kSize), kSize, 0.1);
  const glm::dvec2 moved =
      after.project(front - after.eye()) - before.project(front - before.eye());
  EXPECT_GT(moved.x, 0);
  EXPECT_GT(moved.y, 0);
}

TEST(CameraControls, NoMoveGoesThroughThePole) {
  for (const Camera& camera : cameras())
    for (const double by : {1e9, 700.0, -700.0, -1e9}) {
      Camera around = camera, turning = camera;
      for (int i = 0; i < 3; ++i) {
        around = orbited(around, {0, by}, kSize);
        turning = turned(turning, {0, by}, kSize);
      }
      const double least = std::min({kPoleMargin, pole_angle(camera), kPi - pole_angle(camera)});
      for (const Camera& moved : {around, turning}) {
        EXPECT_EQ(fault_of(moved), "");
        EXPECT_GT(pole_angle(moved), least - 1e-6);
        EXPECT_LT(pole_angle(moved), kPi - least + 1e-6);
      }
      // It stops short of the pole and has not come down on the other side.
      EXPECT_NEAR(std::min(pole_angle(around), kPi - pole_angle(around)), kPoleMargin, 1e-6);
      EXPECT_GT(glm::dot(View(around, kSize, 1).right(), View(camera, kSize, 1).right()), 0.999);
    }
}

TEST(CameraControls, ACameraNearThePoleStaysThereOrComesAway) {
  const Camera camera{.eye = {0, -0.001, 10}};  // 0.0001 radians from looking straight down
  const double angle = kPi - pole_angle(camera);
  EXPECT_NEAR(kPi - pole_angle(orbited(camera, {0, 50}, kSize)), angle, 1e-7);
  EXPECT_NEAR(kPi - pole_angle(orbited(camera, {40, 0}, kSize)), angle, 1e-7);
  EXPECT_NEAR(kPi - pole_angle(orbited(camera, {0, -60}, kSize)), kPi / 10, 1e-3);
}

TEST(CameraControls, ZoomingMultipliesTheDistance) {
  for (const Camera& camera : cameras())
    for (const double factor : {0.1, 1 / kWheelFactor, 1.0, kWheelFactor, 30.0}) {
      const Camera moved = zoomed(camera, factor);
      EXPECT_NEAR(distance_of(moved) / distance_of(camera), factor, 1e-8);
      EXPECT_LT(glm::distance(sight_of(moved), sight_of(camera)), 1e-8);
      EXPECT_EQ(moved.target, camera.target);
    }
}

TEST(CameraControls, NoZoomReachesTheTargetOrLeavesTheWorld) {
  for (const Camera& camera : cameras()) {
    Camera in = camera, out = camera;
    for (int i = 0; i < 2000; ++i) {
      in = zoomed(in, 0.5);
      out = zoomed(out, 3);
      ASSERT_EQ(fault_of(in), "");
      ASSERT_EQ(fault_of(out), "");
    }
    const double largest = std::max(
        {std::fabs(camera.target.x), std::fabs(camera.target.y), std::fabs(camera.target.z)});
    EXPECT_NEAR(distance_of(in) / (1e-10 * largest), 1, 1e-3);
    EXPECT_NEAR(distance_of(out), 1e15, 1e6);
    EXPECT_LT(distance_of(zoomed(out, 1e-14)), 20);  // and there is a way back
  }
}

TEST(CameraControls, PanningKeepsThePointUnderTheCursor) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> along(0, 600);
  for (const Camera& camera : cameras()) {
    const View before(camera, kSize, 0.1);
    const glm::dvec2 from(along(random), along(random)), to(along(random), along(random));
    // The point at the target's depth that appears at `from`.
    const double depth = distance_of(camera), scale = depth / before.focal_pixels();
    const glm::dvec3 point = depth * before.forward() + (from.x - 400) * scale * before.right() +
                             (300 - from.y) * scale * before.up();
    ASSERT_LT(glm::distance(before.project(point), from), 1e-9);
    const Camera moved = panned(camera, from, to, kSize);
    const View after(moved, kSize, 0.1);
    EXPECT_LT(glm::distance(after.project(point + (camera.eye - moved.eye)), to), 1e-5);
    EXPECT_LT(glm::distance(sight_of(moved), sight_of(camera)), 1e-9);
    EXPECT_NEAR(distance_of(moved), distance_of(camera), 1e-8);
  }
}

TEST(CameraControls, TurningMovesTheSightAsTheMouseDoes) {
  for (const Camera& camera : cameras()) {
    const View before(camera, kSize, 0.1);
    const Camera moved = turned(camera, {8, 6}, kSize);
    EXPECT_EQ(moved.eye, camera.eye);
    EXPECT_NEAR(distance_of(moved), distance_of(camera), 1e-8);
    EXPECT_GT(glm::dot(sight_of(moved), before.right()), 0);
    EXPECT_LT(glm::dot(sight_of(moved), before.up()), 0);
    // Down by the picture's height is by its field of view, in a plane through the up direction.
    const double share = 0.1;
    const Camera down = turned(camera, {0, share * 600}, kSize);
    const double fov = camera.fov_y_degrees * kPi / 180;
    EXPECT_NEAR(pole_angle(down), std::min(pole_angle(camera) + share * fov, kPi - kPoleMargin),
                1e-7);
    // Once around, about the up direction.
    EXPECT_LT(glm::distance(turned(camera, {600 * 2 * kPi / fov, 0}, kSize).target, camera.target),
              1e-7);
  }
}

TEST(CameraControls, FlyingFollowsThePicturesAxes) {
  for (const Camera& camera : cameras()) {
    const View view(camera, kSize, 0.1);
    const std::pair<glm::dvec3, glm::dvec3> ways[] = {{{0, 0, 1}, view.forward()},
                                                      {{0, 0, -1}, -view.forward()},
                                                      {{1, 0, 0}, view.right()},
                                                      {{0, 1, 0}, view.up()},
                                                      {{0, 0, 0.25}, 0.25 * view.forward()}};
    for (const auto& [along, axis] : ways) {
      const Camera moved = flown(camera, along, 7);
      EXPECT_LT(glm::distance(moved.eye - camera.eye, 7.0 * axis), 1e-8);
      EXPECT_LT(glm::distance(moved.target - camera.target, 7.0 * axis), 1e-8);
    }
    // Two keys together are no faster than one.
    EXPECT_NEAR(glm::distance(flown(camera, {1, -1, 1}, 7).eye, camera.eye), 7, 1e-8);
    EXPECT_EQ(flown(camera, {0, 0, 0}, 7), camera);
  }
}

TEST(CameraControls, FlyingIsFasterFarFromTheScene) {
  const Box scene{.center = {100, 0, 0}, .half = {3, 4, 12}};  // of radius 13
  EXPECT_DOUBLE_EQ(fly_speed({100, 1004, 0}, scene), 500);
  EXPECT_DOUBLE_EQ(fly_speed({103 + 30, 4 + 40, 12}, scene), 25);
  EXPECT_DOUBLE_EQ(fly_speed({101, 1, 5}, scene), 0.65);
  EXPECT_DOUBLE_EQ(fly_speed({103.1, 0, 0}, scene), 0.65);
}

TEST(CameraControls, AMoveThatEndsNowhereIsNotMade) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Camera camera{.eye = {1, 2, 3}};
  EXPECT_EQ(flown(camera, {0, 0, 1}, 1e300), camera);
  EXPECT_EQ(flown(camera, {0, 0, 1}, kNan), camera);
  EXPECT_EQ(panned(camera, {0, 0}, {1e40, 0}, kSize), camera);
  EXPECT_EQ(orbited(camera, {kNan, 0}, kSize), camera);
  EXPECT_EQ(turned(camera, {0, kNan}, kSize), camera);
}

TEST(CameraControls, AnyRowOfMovesEndsAtAValidCamera) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> pixels(-900, 900), key(-1, 1), factor(0.05, 4);
  for (Camera camera : cameras()) {
    for (int i = 0; i < 500; ++i) {
      switch (random() % 5) {
        case 0:
          camera = orbited(camera, {pixels(random), pixels(random)}, kSize);
          break;
        case 1:
          camera = turned(camera, {pixels(random), pixels(random)}, kSize);
          break;
        case 2:
          camera = zoomed(camera, factor(random));
          break;
        case 3:
          camera = panned(camera, {pixels(random), pixels(random)}, {pixels(random), 0}, kSize);
          break;
        default:
          camera = flown(camera, {key(random), key(random), key(random)}, pixels(random));
      }
      ASSERT_EQ(fault_of(camera), "");
    }
  }
}

}  // namespace
}  // namespace cairn::viewer
