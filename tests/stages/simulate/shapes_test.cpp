// Shapes against intersections worked out by hand, and against their own equations at random rays.
#include "stages/simulate/shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace cairn::stages {
namespace {

double hit(const Shape& shape, const Vector3& origin, const Vector3& towards) {
  double nearest = kNoHit;
  for (std::size_t piece = 0; piece < shape.pieces(); ++piece)
    nearest = std::min(nearest, shape.intersect(piece, {origin, normalised(towards)}));
  return nearest;
}

TEST(Shapes, APlaneIsHitWhereItLies) {
  const auto plane = make_plane(4, 2);
  EXPECT_DOUBLE_EQ(hit(*plane, {0, 0, 3}, {0, 0, -1}), 3);
  EXPECT_DOUBLE_EQ(hit(*plane, {0, 0, -3}, {3, 0, 6}), std::sqrt(1.5 * 1.5 + 9));
  EXPECT_EQ(hit(*plane, {0, 0, 3}, {0, 0, 1}), kNoHit);     // looks away
  EXPECT_EQ(hit(*plane, {2.1, 0, 3}, {0, 0, -1}), kNoHit);  // beside it
  EXPECT_EQ(hit(*plane, {0, 1.1, 3}, {0, 0, -1}), kNoHit);
  EXPECT_EQ(hit(*plane, {0, 0, 3}, {1, 0, 0}), kNoHit);   // parallel
  EXPECT_EQ(hit(*plane, {-5, 0, 0}, {1, 0, 0}), kNoHit);  // in it
}

TEST(Shapes, ABoxIsHitFromOutsideAndFromInside) {
  const auto box = make_box({2, 4, 6});
  EXPECT_DOUBLE_EQ(hit(*box, {10, 0, 0}, {-1, 0, 0}), 9);
  EXPECT_DOUBLE_EQ(hit(*box, {0, 0, 0}, {0, 1, 0}), 2);
  EXPECT_DOUBLE_EQ(hit(*box, {0, 0, 0}, {1, 1, 1}), std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(hit(*box, {5, 4, 0}, {-4, -4, 0}), std::sqrt(32.0));
  EXPECT_EQ(hit(*box, {10, 0, 0}, {1, 0, 0}), kNoHit);
  EXPECT_EQ(hit(*box, {10, 2.1, 0}, {-1, 0, 0}), kNoHit);
  EXPECT_EQ(box->normal(0, {-1, 0.5, 2}), (Vector3{-1, 0, 0}));
  EXPECT_EQ(box->normal(0, {0.5, 1, 3}), (Vector3{0, 0, 1}));
}

TEST(Shapes, ASphereIsHitAtTheDistanceOfTheLawOfCosines) {
  const auto sphere = make_sphere(1);
  for (const double angle : {0.0, 0.01, 0.05, 0.0999}) {
    const double expected = 10 * std::cos(angle) - std::sqrt(1 - std::pow(10 * std::sin(angle), 2));
    EXPECT_NEAR(hit(*sphere, {10, 0, 0}, {-std::cos(angle), std::sin(angle), 0}), expected, 1e-12);
  }
  EXPECT_EQ(hit(*sphere, {10, 0, 0}, {-std::cos(0.1003), std::sin(0.1003), 0}), kNoHit);
  EXPECT_DOUBLE_EQ(hit(*sphere, {0.5, 0, 0}, {1, 0, 0}), 0.5);  // from inside
}

TEST(Shapes, ACylinderHasASideAndTwoLids) {
  const auto cylinder = make_cylinder(1, 4);
  EXPECT_DOUBLE_EQ(hit(*cylinder, {5, 0, 1}, {-1, 0, 0}), 4);
  EXPECT_DOUBLE_EQ(hit(*cylinder, {0.5, 0.5, 9}, {0, 0, -1}), 7);
  EXPECT_DOUBLE_EQ(hit(*cylinder, {0, 0, 0}, {0, 0, -1}), 2);
  EXPECT_EQ(hit(*cylinder, {1.01, 0, 9}, {0, 0, -1}), kNoHit);
  EXPECT_EQ(hit(*cylinder, {5, 0, 2.01}, {-1, 0, 0}), kNoHit);
  // Over the rim of the near side onto the lid: down by 1 over 2 from (3, 0, 3).
  EXPECT_NEAR(hit(*cylinder, {3, 0, 3}, {-2.5, 0, -1}), std::sqrt(2.5 * 2.5 + 1), 1e-12);
  EXPECT_EQ(cylinder->normal(0, {0.2, 0.1, 2}), (Vector3{0, 0, 1}));
}

TEST(Shapes, AThinFarTubeKeepsItsDigits) {
  const auto wire = make_tube({{0, -1, 0}, {0, 1, 0}}, 0.001);
  EXPECT_NEAR(hit(*wire, {10000, 0.3, 0}, {-1, 0, 0}), 9999.999, 1e-9);
  EXPECT_NEAR(hit(*wire, {10000, 0.3, 0.0005}, {-1, 0, 0}), 10000 - 0.001 * std::sqrt(0.75), 1e-9);
  EXPECT_EQ(hit(*wire, {10000, 0.3, 0.0011}, {-1, 0, 0}), kNoHit);
  // Round ends.
  EXPECT_DOUBLE_EQ(hit(*wire, {0, 5, 0}, {0, -1, 0}), 3.999);
}

/// Distance from a point to the nearest of several line segments.
double distance_to_line(const std::vector<Vector3>& points, const Vector3& p) {
  double least = kNoHit;
  for (std::size_t i = 1; i < points.size(); ++i)
    for (int k = 0; k <= 20000; ++k)
      least =
          std::min(least, length(p - (points[i - 1] + (points[i] - points[i - 1]) * (k / 2e4))));
  return least;
}

TEST(Shapes, RandomHitsLieOnTheSurfaceAndNothingLiesBefore) {
  const std::vector<Vector3> line{{-1, 0, 0}, {0.5, 0.5, 0}, {0.5, 0.5, 1}};
  struct Case {
    ShapePtr shape;
    std::function<double(const Vector3&)> field;  ///< negative inside
    double tolerance;
    int rays;
  };
  const auto box_field = [](const Vector3& p) {
    return std::max({std::fabs(p[0]) - 0.5, std::fabs(p[1]) - 0.75, std::fabs(p[2]) - 1});
  };
  const auto cylinder_field = [](const Vector3& p) {
    return std::max(std::hypot(p[0], p[1]) - 0.7, std::fabs(p[2]) - 0.6);
  };
  const std::vector<Case> cases{
      {make_box({1, 1.5, 2}), box_field, 1e-12, 300},
      {make_sphere(0.9), [](const Vector3& p) { return length(p) - 0.9; }, 1e-12, 300},
      {make_cylinder(0.7, 1.2), cylinder_field, 1e-12, 300},
      {make_tube(line, 0.2), [&](const Vector3& p) { return distance_to_line(line, p) - 0.2; },
       1e-8, 5}};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Case& c : cases) {
    int hits = 0;
    for (int i = 0; i < c.rays; ++i) {
      const Vector3 origin = normalised({uniform(random), uniform(random), uniform(random)}) * 4;
      const Vector3 target{uniform(random), uniform(random) * 0.5, uniform(random) * 0.5};
      const Vector3 direction = normalised(target - origin);
      const double t = hit(*c.shape, origin, direction);
      const double end = t < kNoHit ? t : 8;
      for (int k = 1; k < 100; ++k)
        ASSERT_GT(c.field(origin + direction * (end * k / 100.0)), -1e-8);
      if (t == kNoHit) continue;
      ++hits;
      EXPECT_NEAR(c.field(origin + direction * t), 0, c.tolerance);
    }
    EXPECT_GT(hits, c.rays / 5);
  }
}

formats::Mesh fan(int spokes) {
  formats::Mesh mesh;
  mesh.vertices.push_back({0.1, 0.2, 0});
  for (int i = 0; i < spokes; ++i)
    mesh.vertices.push_back(
        {2 * std::cos(i * 2.0 * M_PI / spokes), 2 * std::sin(i * 2.0 * M_PI / spokes), 0});
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(spokes); ++i)
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % static_cast<std::uint32_t>(spokes)});
  return mesh;
}

TEST(Shapes, NoRaySlipsBetweenTrianglesThatShareAnEdge) {
  const formats::Mesh mesh = fan(37);
  const auto shape = make_mesh(mesh);
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 20000; ++i) {
    // A point on a spoke, or the hub itself.
    const Vector3& rim = mesh.vertices[1 + static_cast<std::size_t>(i) % 37];
    const double share = i % 10 == 0 ? 0 : 0.9 * uniform(random);
    const Vector3 target = mesh.vertices[0] + (rim - mesh.vertices[0]) * share;
    const Vector3 origin{uniform(random) * 10 - 5, uniform(random) * 10 - 5, 1 + uniform(random)};
    EXPECT_NEAR(hit(*shape, origin, target - origin), length(target - origin), 1e-12);
  }
}

TEST(Shapes, TrianglesAreHitInsideOnlyAndHaveFlatNormals) {
  const auto shape = make_mesh({{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}}});
  EXPECT_DOUBLE_EQ(hit(*shape, {0.25, 0.25, 0}, {0, 0, 1}), 1);
  EXPECT_DOUBLE_EQ(hit(*shape, {0.25, 0.25, 3}, {0, 0, -1}), 2);
  EXPECT_EQ(hit(*shape, {0.6, 0.6, 0}, {0, 0, 1}), kNoHit);
  EXPECT_EQ(hit(*shape, {0.25, 0.25, 0}, {0, 0, -1}), kNoHit);
  EXPECT_EQ(hit(*shape, {-1, 0.2, 1}, {1, 0, 0}), kNoHit);  // in its plane
  EXPECT_EQ(shape->normal(0, {0.25, 0.25, 1}), (Vector3{0, 0, 1}));
}

TEST(Shapes, ATriangleWithoutAreaIsNeverHit) {
  const auto shape = make_mesh({{{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, {{0, 1, 2}, {0, 0, 0}}});
  EXPECT_EQ(hit(*shape, {0.5, 0, 0}, {0, 0, 1}), kNoHit);
  EXPECT_EQ(hit(*shape, {0, 0, 0}, {0, 0, 1}), kNoHit);
}

}  // namespace
}  // namespace cairn::stages
