// Camera paths: what lies between keyframes, against the pyramid of Barry and Goldman.
#include "viewer/walk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Camera camera_at(const glm::dvec3& eye, const glm::dvec3& target = {0, 0, 0}) {
  return {.eye = eye, .target = target};
}

/// A smooth way that is sampled at uneven times.
std::vector<TimedCamera> uneven_keyframes() {
  std::vector<TimedCamera> keys;
  for (const double t : {0.0, 0.5, 1.25, 1.75, 2.5, 3.0})
    keys.push_back({.time_s = t,
                    .camera = {.eye = {10 * std::cos(t), 10 * std::sin(t), 2 + t},
                               .target = {t, t * t / 5, 0.5},
                               .up = {0.1 * t, 0, 1},
                               .fov_y_degrees = 40 + t}});
  return keys;
}

/// Barry and Goldman: a Catmull-Rom spline is linear interpolation, three times over.
glm::dvec3 barry_goldman(const std::vector<TimedCamera>& keys, std::size_t i, double t,
                         glm::dvec3 Camera::*quantity) {
  const auto point = [&](std::size_t k) { return keys[k].camera.*quantity; };
  const auto time = [&](std::size_t k) { return keys[k].time_s; };
  const auto mix = [&](const glm::dvec3& a, double from, const glm::dvec3& b, double to) {
    return a * ((to - t) / (to - from)) + b * ((t - from) / (to - from));
  };
  const glm::dvec3 a1 = mix(point(i - 1), time(i - 1), point(i), time(i));
  const glm::dvec3 a2 = mix(point(i), time(i), point(i + 1), time(i + 1));
  const glm::dvec3 a3 = mix(point(i + 1), time(i + 1), point(i + 2), time(i + 2));
  const glm::dvec3 b1 = mix(a1, time(i - 1), a2, time(i + 1));
  const glm::dvec3 b2 = mix(a2, time(i), a3, time(i + 2));
  return mix(b1, time(i), b2, time(i + 1));
}

TEST(Walk, HitsKeyframesExactly) {
  const auto keys = uneven_keyframes();
  const Walk walk(keys);
  for (const TimedCamera& key : keys) EXPECT_EQ(walk.at(key.time_s), key.camera) << key.time_s;
}

TEST(Walk, IsTheCatmullRomSplineOverItsTimes) {
  const auto keys = uneven_keyframes();
  const Walk walk(keys);
  for (std::size_t i = 1; i + 2 < keys.size(); ++i)
    for (double u = 0; u < 1; u += 0.125) {
      const double t = keys[i].time_s + u * (keys[i + 1].time_s - keys[i].time_s);
      const Camera camera = walk.at(t);
      for (const auto quantity : {&Camera::eye, &Camera::target, &Camera::up})
        EXPECT_LT(glm::distance(camera.*quantity, barry_goldman(keys, i, t, quantity)), 1e-12);
      EXPECT_NEAR(camera.fov_y_degrees, 40 + t, 1e-12);
    }
}

TEST(Walk, BetweenTwoKeyframesItIsALine) {
  const Walk walk({{1, camera_at({0, 1, 5})}, {3, camera_at({8, 1, 5})}});
  for (double t = 1; t <= 3; t += 0.25)
    EXPECT_LT(glm::distance(walk.at(t).eye, glm::dvec3(4 * (t - 1), 1, 5)), 1e-12);
}

TEST(Walk, EvenMotionStaysEvenThroughUnevenTimes) {
  std::vector<TimedCamera> keys;
  for (const double t : {0.0, 0.1, 1.0, 1.5, 4.0}) keys.push_back({t, camera_at({5 * t, 1, 1})});
  const Walk walk(keys);
  for (double t = 0; t <= 4; t += 0.01) EXPECT_NEAR(walk.at(t).eye.x, 5 * t, 1e-12);
}

TEST(Walk, NeitherPositionNorSpeedJumps) {
  const auto keys = uneven_keyframes();
  const Walk walk(keys);
  constexpr double kStep = 1e-6;
  for (std::size_t i = 1; i + 1 < keys.size(); ++i) {
    const double t = keys[i].time_s;
    const glm::dvec3 before = (walk.at(t).eye - walk.at(t - kStep).eye) / kStep;
    const glm::dvec3 after = (walk.at(t + kStep).eye - walk.at(t).eye) / kStep;
    EXPECT_LT(glm::distance(before, after), 1e-3) << i;  // of about 10 units a second
    EXPECT_GT(glm::length(before), 5) << i;
  }
}

TEST(Walk, RestsBetweenEqualCameras) {
  const Camera here = camera_at({10, 0, 2}), there = camera_at({0, 10, 2}, {0, 0, 1});
  const Walk walk({{0, here}, {1, there}, {5, there}, {6, here}, {7, here}});
  for (double t = 1; t <= 5; t += 0.1) EXPECT_EQ(walk.at(t), there) << t;
  for (double t = 6; t <= 7; t += 0.1) EXPECT_EQ(walk.at(t), here) << t;
}

TEST(Walk, DoesNotSwingOutBesideAJump) {
  // A hundred units in a hundredth of a second, between slow parts.
  const Walk walk({{0, camera_at({0, 5, 1})},
                   {1, camera_at({1, 5, 1})},
                   {1.01, camera_at({101, 5, 1})},
                   {2, camera_at({102, 5, 1})}});
  double before = 0;
  for (double t = 0; t <= 2; t += 0.001) {
    const double x = walk.at(t).eye.x;
    EXPECT_GE(x, before - 1e-9) << t;
    EXPECT_LE(x, 102 + 1e-9) << t;
    before = x;
  }
}

TEST(Walk, OutsideOfItsTimesItRests) {
  const auto keys = uneven_keyframes();
  const Walk walk(keys);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double t : {-1.0, -kInfinity}) EXPECT_EQ(walk.at(t), keys.front().camera);
  for (const double t : {3.0, 99.0, kInfinity}) EXPECT_EQ(walk.at(t), keys.back().camera);
  EXPECT_TRUE(fault_of(walk.at(std::numeric_limits<double>::quiet_NaN())).empty());
  EXPECT_EQ(Walk({{2, keys[0].camera}}).at(1), keys[0].camera);
}

TEST(Walk, AlwaysGivesAValidCamera) {
  const Camera above{.eye = {0, 0, 5}, .target = {0, 0, 0}, .up = {0, 1, 0}};
  const Camera below{.eye = {0, 0, -5}, .target = {0, 0, 0}, .up = {0, -1, 0}};
  const Walk through({{0, above}, {1, below}});
  for (const TimedCamera& frame : through.frames(64))
    EXPECT_EQ(fault_of(frame.camera), "") << frame.time_s;
  // The eye is the target here, so the keyframe before stands in.
  EXPECT_EQ(through.at(0.5), above);
  const Camera far{.eye = {1.5e308, 0, 0}, .target = {1.4e308, 0, 0}};
  const Camera other{.eye = {-1.5e308, 0, 0}, .target = {-1.4e308, 0, 0}};
  EXPECT_EQ(Walk({{0, far}, {1, other}}).at(0.25), far);
}

TEST(Walk, FramesAreEvenInTimeAndReachTheEnd) {
  const Walk walk(uneven_keyframes());
  for (const double rate : {0.1, 1.0, 7.0, 10.0, 30.0, 1000.0 / 3}) {
    const auto frames = walk.frames(rate);
    EXPECT_EQ(frames.size(), std::floor(3 * rate + 1e-9) + 1);
    EXPECT_EQ(frames.front().time_s, 0);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_NEAR(frames[i].time_s, static_cast<double>(i) / rate, 1e-12);
      EXPECT_EQ(frames[i].camera, walk.at(frames[i].time_s));
    }
  }
  EXPECT_EQ(walk.frames(30).back().camera, walk.keyframes().back().camera);
  EXPECT_EQ(Walk({{0, camera_at({1, 0, 0})}}).frames(30).size(), 1U);
}

std::string refusal(std::vector<TimedCamera> keys, double rate = 30) {
  try {
    const Walk walk(std::move(keys), rate);
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    return error.what();
  }
  return "no error";
}

TEST(Walk, RefusesWhatIsNoWalk) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Camera good = camera_at({1, 0, 0});
  EXPECT_EQ(refusal({}), "a walk without a camera");
  EXPECT_EQ(refusal({{-1, good}}), "camera 1: time: found -1, expected at least 0");
  EXPECT_EQ(refusal({{1, good}, {1, good}}), "camera 2: time: found 1, expected above 1");
  EXPECT_THAT(refusal({{kNan, good}}), StartsWith("camera 1: time"));
  EXPECT_THAT(refusal({{0, good}, {kInfinity, good}}), StartsWith("camera 2: time"));
  EXPECT_THAT(refusal({{0, good}, {1, camera_at({0, 0, 0})}}), StartsWith("camera 2: a camera"));
  for (const double rate : {0.0, -1.0, kNan, 1001.0})
    EXPECT_THAT(refusal({{0, good}}, rate), HasSubstr("frames a second of a walk")) << rate;
  EXPECT_THAT(refusal({{0, good}, {1e300, good}}), HasSubstr("at most 1000000 frames"));
  EXPECT_THROW(Walk({{0, good}, {3600, good}}).frames(1000), formats::Error);
}

TEST(Walk, AnOrbitKeepsItsRadiusAndItsCenter) {
  const Walk walk =
      orbit_walk({.center = {1e6, 2e6, 30}, .radius = 20, .height = 5, .seconds = 8, .turns = 1.5});
  EXPECT_EQ(walk.duration_s(), 8);
  for (const TimedCamera& frame : walk.frames(100)) {
    const glm::dvec3 from_center = frame.camera.eye - glm::dvec3(1e6, 2e6, 30);
    EXPECT_NEAR(std::hypot(from_center.x, from_center.y), 20, 2e-3);
    EXPECT_NEAR(from_center.z, 5, 1e-9);
    EXPECT_EQ(frame.camera.target, glm::dvec3(1e6, 2e6, 30));
    const double turned = 1.5 * 2 * std::numbers::pi * frame.time_s / 8;
    const glm::dvec2 expected(std::sin(turned), -std::cos(turned));  // from the south, to the east
    EXPECT_LT(glm::distance(glm::dvec2(from_center) / 20.0, expected), 1e-3);
  }
}

TEST(Walk, RefusesAnOrbitThatIsNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Orbit& orbit :
       {Orbit{.radius = 0}, Orbit{.radius = kNan}, Orbit{.height = kNan}, Orbit{.seconds = 0},
        Orbit{.turns = 1e9}, Orbit{.turns = kNan}, Orbit{.fov_y_degrees = 180},
        Orbit{.radius = 1e-7, .height = 1}, Orbit{.seconds = 1e18}})
    EXPECT_THROW(orbit_walk(orbit), formats::Error);
}

}  // namespace
}  // namespace cairn::viewer
