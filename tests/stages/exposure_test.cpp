// Scans of one textured surface, each with an exposure of its own: the gains undo what the exposures did.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "stages/filter/gain_solver.h"
#include "stages/portable_log.h"
#include "tests/support/filter_campaign.h"

namespace cairn::stages {
namespace {

using test::ColoredCampaign;
using test::ColoredPoint;

constexpr double kNoise = 0.02;

/// Scan s sees x from 30,000 s to 30,000 s + 60,000 of a floor of smooth brightness.
ColoredCampaign floor_scans(const std::vector<std::array<double, 3>>& exposures) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(1, kNoise);
  ColoredCampaign points;
  for (std::uint32_t s = 0; s < exposures.size(); ++s)
    for (int i = 0; i < 20'000; ++i) {
      ColoredPoint p{{static_cast<std::int32_t>(30'000 * s + random() % 60'000),
                      static_cast<std::int32_t>(random() % 60'000), 0},
                     static_cast<std::uint32_t>(points.size()),
                     {},
                     s};
      const double light =
          20'000 + 8'000 * std::sin(p.position[0] / 9'000.0) * std::cos(p.position[1] / 11'000.0);
      for (std::size_t c = 0; c < 3; ++c)
        p.color[c] = static_cast<std::uint16_t>(
            std::clamp(std::round(light * exposures[s][c] * noise(random)), 0.0, 65535.0));
      points.push_back(p);
    }
  return points;
}

/// The mean |logarithm| of how much scans differ in voxels that they share.
double disagreement(const ColoredCampaign& points) {
  std::map<std::array<std::int32_t, 2>, std::map<std::uint32_t, std::pair<double, int>>> voxels;
  for (const ColoredPoint& p : points) {
    auto& [sum, count] = voxels[{p.position[0] / 3000, p.position[1] / 3000}][p.scan];
    sum += p.color[0];
    ++count;
  }
  double sum = 0;
  int pairs = 0;
  for (const auto& [cell, scans] : voxels)
    for (auto a = scans.begin(); a != scans.end(); ++a)
      for (auto b = std::next(a); b != scans.end(); ++b, ++pairs)
        sum += std::fabs(std::log(a->second.first / a->second.second) -
                         std::log(b->second.first / b->second.second));
  return sum / pairs;
}

class ExposureTest : public test::FilterFixture {};

TEST_F(ExposureTest, GainsUndoTheExposures) {
  const std::vector<std::array<double, 3>> exposures{{0.8, 1, 1.1}, {1, 1.2, 0.9}, {1.3, 0.7, 1}};
  const ColoredCampaign points = floor_scans(exposures);
  for (const std::uint64_t node_points : {500U, 100'000U}) {
    const auto result = run(points, {.balance_exposure = true}, node_points);
    EXPECT_EQ(result.points.size(), points.size());
    // Two scans share 10,000 points of each: by their noise alone the mean of one differs from that of the other by
    // 0.02 sqrt(2 / 10,000) = 0.0003, twice that over two overlaps. Texture in a voxel adds to it, and what holds gains
    // at 1: a share of 1 / 5,000.
    for (std::size_t c = 0; c < 3; ++c) {
      double mean = 0, mean_gain = 0;
      std::array<double, 3> product;
      for (std::size_t s = 0; s < 3; ++s) {
        const double gain = result.filtered.sources[s].gain[c] / 65536.0;
        product[s] = std::log(gain * exposures[s][c]);
        mean += product[s] / 3;
        mean_gain += std::log(gain) / 3;
      }
      EXPECT_NEAR(mean_gain, 0, 2e-5);  // gains are told to 2^-16
      for (const double p : product) EXPECT_NEAR(p, mean, 0.003) << c;
    }
    EXPECT_GT(disagreement(points), 0.2);
    EXPECT_LT(disagreement(result.points), 0.01);
  }
}

TEST_F(ExposureTest, ClippedPlacesTellNothing) {
  ColoredCampaign points =
      floor_scans({{1, 1, 1}, {2.6, 1, 1}});  // bright parts of scan 1 are clipped
  const auto result = run(points, {.balance_exposure = true}, 500);
  const auto& sources = result.filtered.sources;
  EXPECT_NEAR(std::log(static_cast<double>(sources[0].gain[0]) / sources[1].gain[0]), std::log(2.6),
              0.01);
  std::uint64_t clamped = 0;
  for (const ColoredPoint& p : points)
    clamped += p.scan == 0 && p.color[0] * (sources[0].gain[0] / 65536.0) >= 65535.5 ? 1 : 0;
  EXPECT_EQ(sources[0].clamped, clamped);
  EXPECT_EQ(sources[1].clamped, 0U);
}

TEST_F(ExposureTest, AFewClippedValuesDoNotSilenceDensePlaces) {
  // All points of the second half of each scan lie in 36 cells, of some 500 points, of which one in 200 is black.
  ColoredCampaign points = floor_scans({{1, 1, 1}, {1.25, 1, 1}});
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::int32_t& c : points[i].position) c = c / 20'000 * 20'000 + c % 2'000;
    if (i % 200 == 0) points[i].color = {0, 0, 0};
  }
  const auto& sources = run(points, {.balance_exposure = true}, 500).filtered.sources;
  EXPECT_NEAR(std::log(static_cast<double>(sources[0].gain[0]) / sources[1].gain[0]),
              std::log(1.25), 0.02);
}

TEST_F(ExposureTest, ScansThatShareNothingStayAsTheyAre) {
  ColoredCampaign points = floor_scans({{0.8, 1, 1.1}, {1.2, 1, 1}});
  for (ColoredPoint& p : points) p.position[2] = static_cast<std::int32_t>(p.scan) * 1'000'000;
  const auto result = run(points, {.balance_exposure = true}, 500);
  for (const auto& source : result.filtered.sources)
    EXPECT_EQ(source.gain, (std::array<std::uint32_t, 3>{65536, 65536, 65536}));
  std::sort(points.begin(), points.end());
  EXPECT_EQ(result.points, points);
}

/// The derivatives of sum w (x_i - x_j + d)^2 + sum x_i^2 vanish.
TEST(GainSolver, SolvesTheNormalEquations) {
  Overlaps overlaps;
  overlaps[{0, 1}].add(0.5, 3);
  overlaps[{1, 2}].add(-0.25, 2);
  const std::vector<double> x = solve_log_gains(overlaps, 4);
  EXPECT_NEAR(4 * x[0] - 3 * x[1], -1.5, 1e-9);
  EXPECT_NEAR(-3 * x[0] + 6 * x[1] - 2 * x[2], 1.5 + 0.5, 1e-9);
  EXPECT_NEAR(-2 * x[1] + 3 * x[2], -0.5, 1e-9);
  EXPECT_EQ(x[3], 0);
}

TEST(PortableLog, IsThatOfTheLibrary) {
  for (const double x : {1e-9, 0.3, 0.999, 1.0, 1.0001, 2.0, 65534.5, 1e18})
    EXPECT_NEAR(portable_log(x), std::log(x), 1e-14 * std::max(1.0, std::fabs(std::log(x)))) << x;
  for (const double x : {-20.0, -0.4, -1e-9, 0.0, 0.3, 1.0, 19.5})
    EXPECT_NEAR(portable_exp(x) / std::exp(x), 1, 1e-14) << x;
}

}  // namespace
}  // namespace cairn::stages
