// The statue against its own field, which defines it.
#include "stages/simulate/statue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace cairn::stages {
namespace {

struct StatueHit {
  double distance = kNoHit;
  std::size_t piece = 0;
};

/// Brute force over the pieces, as a hierarchy would do it.
StatueHit hit(const Statue& statue, const Ray& ray) {
  StatueHit nearest;
  for (std::size_t piece = 0; piece < statue.pieces(); ++piece) {
    const double t = statue.intersect(piece, ray);
    if (t < nearest.distance) nearest = {t, piece};
  }
  return nearest;
}

Ray random_ray(std::mt19937_64& random, double height) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vector3 origin{3 * height * uniform(random), 3 * height * uniform(random),
                       height * (1 + uniform(random))};
  const Vector3 target{0.1 * height * uniform(random), 0.1 * height * uniform(random),
                       height * (0.5 + 0.45 * uniform(random))};
  return {origin, normalised(target - origin)};
}

TEST(Statue, HitsLieOnTheSurfaceAndTheWayThereIsOutside) {
  const double height = 2.5;
  const Statue statue(height);
  std::mt19937_64 random(3);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, height);
    if (statue.field(ray.origin) <= 0) continue;
    const StatueHit found = hit(statue, ray);
    const double end = std::min(found.distance, 6 * height);
    for (int k = 1; k < 2000; ++k)
      ASSERT_GT(statue.field(ray.origin + ray.direction * (end * k / 2000.0)), -1e-5) << i;
    if (found.distance == kNoHit) continue;
    ++hits;
    EXPECT_NEAR(statue.field(ray.origin + ray.direction * found.distance), 0, 1e-12);
  }
  EXPECT_GT(hits, 150);
}

TEST(Statue, NormalsAreTheFieldsSlopeByDifferences) {
  const Statue statue(1.8);
  std::mt19937_64 random(4);
  int hits = 0;
  for (int i = 0; i < 200; ++i) {
    const Ray ray = random_ray(random, 1.8);
    const StatueHit found = hit(statue, ray);
    if (found.distance == kNoHit || statue.field(ray.origin) <= 0) continue;
    const Vector3 p = ray.origin + ray.direction * found.distance;
    Vector3 slope{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Vector3 step{};
      step[axis] = 1e-6;
      slope[axis] = (statue.field(p + step) - statue.field(p - step)) / 2e-6;
    }
    EXPECT_LT(length(statue.normal(found.piece, p) - normalised(slope)), 1e-6);
    EXPECT_LE(length(slope), Statue::steepest() + 1e-6);
    ++hits;
  }
  EXPECT_GT(hits, 80);
}

TEST(Statue, IsClosedAndStandsOnTheGround) {
  const Statue statue(2);
  const Box box = statue.whole();
  // From its middle every way leads out.
  EXPECT_LT(statue.field({0, 0, 1}), 0);
  for (int i = 0; i < 500; ++i) {
    const double z = 2 * (i + 0.5) / 500 - 1, turn = i * 2.399963;
    const double r = std::sqrt(1 - z * z);
    EXPECT_GT(statue.field({5 * r * std::cos(turn), 5 * r * std::sin(turn), 1 + 5 * z}), 0);
  }
  EXPECT_GT(box.min[2], -0.2);
  EXPECT_NEAR(box.max[2], 2, 0.1);
  EXPECT_GT(statue.field({0.3, 0, -0.15}), 0);
}

}  // namespace
}  // namespace cairn::stages
