// Poses by their formulas, and scans placed by them.
#include "formats/scans/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "formats/error.h"
#include "formats/scans/posed_scan.h"
#include "tests/support/stage_fixture.h"

namespace cairn::formats {
namespace {

constexpr double kHalf = 0.70710678118654752;  // cosine and sine of a quarter of pi

void expect_near(const Vector3& found, const Vector3& expected) {
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], expected[axis], 1e-12);
}

TEST(Pose, AQuaternionTurnsAboutItsAxis) {
  // A quarter turn about z sends x to y; quaternions of any length mean the same.
  for (const double length : {1.0, 3.0, 1e-3}) {
    const auto about_z = rotation_of(length * kHalf, 0, 0, length * kHalf).value();
    expect_near(multiply(about_z, {1, 0, 0}), {0, 1, 0});
    expect_near(multiply(about_z, {0, 0, 1}), {0, 0, 1});
  }
  const auto about_x = rotation_of(kHalf, kHalf, 0, 0).value();
  expect_near(multiply(about_x, {0, 1, 0}), {0, 0, 1});
  const auto about_y = rotation_of(kHalf, 0, kHalf, 0).value();
  expect_near(multiply(about_y, {0, 0, 1}), {1, 0, 0});
  // Rodrigues: a third of a turn about (1, 1, 1) permutes the axes.
  const auto diagonal = rotation_of(0.5, 0.5, 0.5, 0.5).value();
  expect_near(multiply(diagonal, {1, 2, 3}), {3, 1, 2});
  EXPECT_FALSE(rotation_of(0, 0, 0, 0));
  EXPECT_FALSE(rotation_of(NAN, 0, 0, 1));
}

TEST(Pose, PlacesByRotationThenTranslation) {
  const Pose pose{.linear = rotation_of(kHalf, 0, 0, kHalf).value(), .translation = {10, 20, 30}};
  expect_near(place(pose, {1, 2, 3}), {8, 21, 33});
  EXPECT_EQ(place(Pose{}, {1, 2, 3}), (Vector3{1, 2, 3}));
}

TEST(Pose, TransposingARotationUndoesIt) {
  const auto turn = rotation_of(0.2, -0.4, 0.5, 0.7).value();
  expect_near(multiply(transposed(turn), multiply(turn, {1, 2, 3})), {1, 2, 3});
}

// The normal of a plane stays at right angles to vectors in it, however the plane is stretched.
TEST(Pose, NormalsStayPerpendicularUnderScales) {
  const Pose pose{.linear = {{{1, 0.5, 0}, {0, 2, 0}, {0.25, 0, 3}}}, .translation = {}};
  const Vector3 normal{1, 2, -1}, along{1, 0, 1}, across{2, -1, 0};
  const Vector3 turned = multiply(normal_matrix(pose), normal);
  for (const Vector3& v : {along, across}) {
    const Vector3 moved = multiply(pose.linear, v);
    EXPECT_NEAR(turned[0] * moved[0] + turned[1] * moved[1] + turned[2] * moved[2], 0, 1e-12);
  }
  const auto rotation = rotation_of(0.2, -0.4, 0.5, 0.7).value();
  EXPECT_EQ(normal_matrix({.linear = rotation, .translation = {}}), rotation);
}

TEST(Pose, IsUsableIfFiniteAndInvertible) {
  EXPECT_TRUE(is_usable(Pose{}));
  EXPECT_FALSE(is_usable({.linear = {{{1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}, .translation = {}}));
  EXPECT_FALSE(is_usable({.translation = {std::numeric_limits<double>::infinity(), 0, 0}}));
  EXPECT_FALSE(is_usable({.linear = {{{1, 0, 0}, {0, NAN, 0}, {0, 0, 1}}}, .translation = {}}));
  EXPECT_FALSE(
      is_usable({.linear = {{{1e-120, 0, 0}, {0, 1e-120, 0}, {0, 0, 1e-120}}}, .translation = {}}));
}

PointBlock block_of(std::vector<std::array<std::int32_t, 3>> steps, std::vector<float> normals) {
  PointBlock block;
  block.count = steps.size();
  block.no_return = 3;
  block.steps = std::move(steps);
  const auto bytes = std::as_bytes(std::span(normals));
  block.columns.emplace_back(bytes.begin(), bytes.end());
  return block;
}

TEST(PosedScan, PlacesStepsTurnsNormalsAndMovesTheSensor) {
  const Schema schema{{"normal", ScalarType::kF32, 3, ReduceRule::kNormal}};
  auto scan = test::steps_scan(schema, {block_of({{{1, 2, 3}}, {{0, 0, 0}}}, {1, 0, 0, 0, 0, -1})},
                               {0.5, 0.25, 2}, {100, 0, -1});
  scan->set_sensor({1, 0, 0});
  const Pose quarter{.linear = rotation_of(kHalf, 0, 0, kHalf).value(),
                     .translation = {10, 20, 30}};
  const auto placed = place_scan(std::move(scan), quarter);
  EXPECT_EQ(placed->info().encoding, PositionEncoding::kFloat64);
  EXPECT_FALSE(placed->info().pose);
  expect_near(placed->info().sensor.value(), {10, 21, 30});
  std::size_t blocks = 0;
  placed->read(0, [&](const PointBlock& block) {
    ++blocks;
    ASSERT_EQ(block.count, 2U);
    EXPECT_EQ(block.no_return, 3U);
    EXPECT_TRUE(block.steps.empty());
    // (100.5, 0.5, 5) turned is (-0.5, 100.5, 5).
    expect_near(block.world[0], {9.5, 120.5, 35});
    std::array<float, 6> normals{};
    std::memcpy(normals.data(), block.columns[0].data(), sizeof normals);
    EXPECT_NEAR(normals[0], 0, 1e-6);
    EXPECT_NEAR(normals[1], 1, 1e-6);
    EXPECT_NEAR(normals[5], -1, 1e-6);
  });
  EXPECT_EQ(blocks, 1U);
}

TEST(PosedScan, RefusesAPoseThatCannotBeUsed) {
  auto scan = test::steps_scan({}, {});
  EXPECT_THROW(place_scan(std::move(scan), {.linear = {}, .translation = {}}), Error);
}

}  // namespace
}  // namespace cairn::formats
