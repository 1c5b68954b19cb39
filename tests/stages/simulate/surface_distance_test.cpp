// Distances from surfaces against their formulas, and from triangles against points strewn over them.
#include "stages/simulate/surface_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "stages/simulate/statue.h"

namespace cairn::stages {
namespace {

SceneObject object_at(ShapePtr shape, const Vector3& position,
                      const Quaternion& turn = {1, 0, 0, 0}) {
  SceneObject object;
  object.shape = std::move(shape);
  object.pose = pose_at(position, turn);
  return object;
}

double distance_of(const ShapePtr& shape, const Vector3& point) {
  const std::vector<SceneObject> objects{object_at(shape, {0, 0, 0})};
  return SurfaceDistance(objects).distance(point);
}

TEST(SurfaceDistance, OfASphereIsTheDifferenceOfRadii) {
  const auto sphere = make_sphere(2);
  EXPECT_NEAR(distance_of(sphere, {3, 4, 12}), 11, 1e-14);
  EXPECT_NEAR(distance_of(sphere, {0.3, 0.4, 0}), 1.5, 1e-14);
  EXPECT_NEAR(distance_of(sphere, {0, 0, 0}), 2, 1e-14);
}

TEST(SurfaceDistance, OfARectangleIsThatOfItsInsideItsEdgesOrItsCorners) {
  const auto plane = make_plane(4, 2);
  EXPECT_EQ(distance_of(plane, {1.9, -0.9, 3}), 3);
  EXPECT_EQ(distance_of(plane, {5, 0, 4}), 5);
  EXPECT_EQ(distance_of(plane, {4, 4, 6}), 7);
  EXPECT_EQ(distance_of(plane, {1, 1, 0}), 0);
}

TEST(SurfaceDistance, OfABoxFromOutsideAndFromInside) {
  const auto box = make_box({2, 4, 6});
  EXPECT_EQ(distance_of(box, {0.5, 1.5, 5}), 2);
  EXPECT_EQ(distance_of(box, {3, 4, 6}), std::sqrt(4.0 + 4 + 9));
  EXPECT_EQ(distance_of(box, {0.75, 0, 0}), 0.25);
  EXPECT_EQ(distance_of(box, {0, 0, 2.5}), 0.5);
  EXPECT_EQ(distance_of(box, {1, 2, 0}), 0);
}

TEST(SurfaceDistance, OfACylinderFromItsSideALidAndItsRim) {
  const auto cylinder = make_cylinder(1, 4);
  EXPECT_NEAR(distance_of(cylinder, {3, 4, 1}), 4, 1e-14);
  EXPECT_NEAR(distance_of(cylinder, {0.3, 0.4, 5}), 3, 1e-14);
  EXPECT_NEAR(distance_of(cylinder, {0, -4, 6}), 5, 1e-14);
  EXPECT_NEAR(distance_of(cylinder, {0.9, 0, 0}), 0.1, 1e-14);
  EXPECT_NEAR(distance_of(cylinder, {0, 0, -1.75}), 0.25, 1e-14);
}

TEST(SurfaceDistance, OfATubeHasNoWallsWherePiecesMeet) {
  const auto tube = make_tube({{0, 0, 0}, {5, 0, 0}, {10, 0, 0}}, 1);
  EXPECT_NEAR(distance_of(tube, {5.2, 3, 4}), 4, 1e-14);
  EXPECT_NEAR(distance_of(tube, {13, 4, 0}), 4, 1e-14);
  for (const double x : {4.5, 5.0, 5.3, 5.9})
    EXPECT_NEAR(distance_of(tube, {x, 0.75, 0}), 0.25, 1e-14) << x;
}

TEST(SurfaceDistance, OfACubeOfTrianglesIsThatOfABox) {
  formats::Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 2.0 : -2.0, i & 4 ? 3.0 : -3.0});
  for (const auto& q :
       {std::array{0U, 2U, 3U, 1U}, std::array{4U, 5U, 7U, 6U}, std::array{0U, 1U, 5U, 4U},
        std::array{2U, 6U, 7U, 3U}, std::array{0U, 4U, 6U, 2U}, std::array{1U, 3U, 7U, 5U}}) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  const auto cube = make_mesh(mesh), box = make_box({2, 4, 6});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-5, 5);
  const std::vector<SceneObject> triangles{object_at(cube, {0, 0, 0})};
  const SurfaceDistance surface(triangles);
  for (int i = 0; i < 2000; ++i) {
    const Vector3 point{anywhere(random), anywhere(random), anywhere(random)};
    EXPECT_NEAR(surface.distance(point), box->distance(0, point), 1e-13);
  }
}

TEST(SurfaceDistance, OfATriangleIsThatOfItsNearestPoint) {
  const std::array<Vector3, 3> corners{{{0, 0, 1}, {4, 1, 0}, {1, 3, 2}}};
  formats::Mesh mesh;
  mesh.vertices.assign(corners.begin(), corners.end());
  mesh.triangles.push_back({0, 1, 2});
  const auto triangle = make_mesh(mesh);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> anywhere(-4, 6);
  constexpr int kParts = 200;
  for (int i = 0; i < 30; ++i) {
    const Vector3 point{anywhere(random), anywhere(random), anywhere(random)};
    double nearest = kNoHit;
    for (int a = 0; a <= kParts; ++a)
      for (int b = 0; a + b <= kParts; ++b) {
        const double s = double(a) / kParts, t = double(b) / kParts;
        nearest = std::min(
            nearest, length(corners[0] * (1 - s - t) + corners[1] * s + corners[2] * t - point));
      }
    const double found = triangle->distance(0, point);
    EXPECT_LE(found, nearest + 1e-12);
    EXPECT_GE(found,
              nearest - 4.5 / kParts);  // no place is farther than an edge's part from one of them
  }
}

TEST(SurfaceDistance, OfManyObjectsFarFromTheOriginIsTheLeast) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-50, 50), size(0.1, 4), angle(-180, 180);
  const Vector3 far{4'500'000, -5'300'000, 200};
  std::vector<SceneObject> objects;
  std::vector<std::function<double(const Vector3&)>> formulas;
  for (int i = 0; i < 200; ++i) {
    const Vector3 center = far + Vector3{place(random), place(random), place(random)};
    if (i % 2 == 0) {
      const double radius = size(random);
      objects.push_back(object_at(make_sphere(radius), center));
      formulas.emplace_back(
          [=](const Vector3& p) { return std::fabs(length(p - center) - radius); });
    } else {
      const double yaw = angle(random), half = size(random);
      objects.push_back(object_at(make_plane(2 * half, 2 * half), center, turned(yaw, 0, 0)));
      const double c = std::cos(yaw * std::acos(-1.0) / 180),
                   s = std::sin(yaw * std::acos(-1.0) / 180);
      formulas.emplace_back([=](const Vector3& p) {
        const Vector3 d = p - center;
        const double x = std::fabs(c * d[0] + s * d[1]), y = std::fabs(c * d[1] - s * d[0]);
        return length({std::max(0.0, x - half), std::max(0.0, y - half), d[2]});
      });
    }
  }
  const SurfaceDistance surface(objects);
  for (int i = 0; i < 2000; ++i) {
    const Vector3 point = far + Vector3{place(random), place(random), place(random)} * 2;
    double least = kNoHit;
    for (const auto& formula : formulas) least = std::min(least, formula(point));
    EXPECT_NEAR(surface.distance(point), least, 1e-8);
  }
}

TEST(SurfaceDistance, OfAStatueAlongItsNormalIsTheWay) {
  const auto statue = std::make_shared<Statue>(2);
  const std::vector<SceneObject> objects{object_at(statue, {0, 0, 0})};
  const SurfaceDistance surface(objects);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> height(0.1, 1.8), angle(-3, 3);
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    const double a = angle(random);
    const Vector3 from{3 * std::cos(a), 3 * std::sin(a), height(random)};
    const Ray ray{from, normalised(Vector3{0, 0, from[2]} - from)};
    for (std::size_t piece = 0; piece < statue->pieces(); ++piece) {
      const double t = statue->intersect(piece, ray);
      if (t == kNoHit) continue;
      const Vector3 hit = ray.origin + ray.direction * t;
      // The sharpest bumps have a radius of 12 mm a metre of height.
      for (const double way : {0.001, -0.001, 0.0})
        EXPECT_NEAR(surface.distance(hit + statue->normal(piece, hit) * way), std::fabs(way), 1e-7);
      ++hits;
      break;
    }
  }
  EXPECT_GT(hits, 30);
  for (const Vector3& far : {Vector3{3, 1, 1}, Vector3{0, 0, 4}, Vector3{0.1, -2, 0.5}})
    EXPECT_GE(surface.distance(far), statue->field(far) / Statue::steepest());
}

}  // namespace
}  // namespace cairn::stages
