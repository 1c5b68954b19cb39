// Effects against the formulas of their headers: moments within the intervals of their distributions, and what must
// not change.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stages/simulate/effects/angular_jitter.h"
#include "stages/simulate/effects/beam_divergence.h"
#include "stages/simulate/effects/dropouts.h"
#include "stages/simulate/effects/dust.h"
#include "stages/simulate/effects/exposure.h"
#include "stages/simulate/effects/foliage.h"
#include "stages/simulate/effects/intensity_falloff.h"
#include "stages/simulate/effects/outliers.h"
#include "stages/simulate/effects/range_noise.h"
#include "tests/stages/simulate/simulated_scan.h"

namespace cairn::stages {
namespace {

/// What differs by chance lies within so many standard deviations; the draws are the same on every run.
constexpr double kDeviations = 4;
constexpr double kDegree = std::numbers::pi / 180;
constexpr Rgb kWhite{255, 255, 255};

template <typename Settings, typename Make>
ChosenEffect chosen(EffectKind kind, const Settings& settings, Make make) {
  return {kind, [=](const Draws& draws) { return make(settings, draws); }};
}
ChosenEffect noise(double base, double per_length) {
  return chosen(EffectKind::kRangeNoise, RangeNoise{base, per_length}, make_range_noise);
}
ChosenEffect jitter(double azimuth, double elevation) {
  return chosen(EffectKind::kAngularJitter, AngularJitter{azimuth, elevation}, make_angular_jitter);
}
ChosenEffect dropouts(double photons, double range) {
  return chosen(EffectKind::kDropouts, Dropouts{photons, range}, make_dropouts);
}
ChosenEffect dust(double mean_free_path) {
  return chosen(EffectKind::kDust, Dust{.mean_free_path = mean_free_path}, make_dust);
}
ChosenEffect outliers(double share) {
  return chosen(EffectKind::kOutliers, Outliers{share}, make_outliers);
}
ChosenEffect exposure(double stops, double balance) {
  return chosen(EffectKind::kExposure, Exposure{stops, balance}, make_exposure);
}
ChosenEffect falloff(double range, double attenuation) {
  return {EffectKind::kIntensityFalloff, [=](const Draws&) {
            return make_intensity_falloff({range, attenuation});
          }};
}

ChosenEffect divergence(double angle, double resolution, unsigned rays) {
  return {EffectKind::kBeamDivergence, [=](const Draws&) {
            return make_beam_divergence({angle, resolution, rays});
          }};
}
ChosenEffect foliage(std::uint32_t returns, double blocked) {
  return chosen(EffectKind::kFoliage, Foliage{returns, blocked}, make_foliage);
}

StationEffects effects(std::vector<ChosenEffect> of_echoes, std::size_t station = 0,
                       std::uint64_t seed = 0) {
  Effects named;
  named.seed = seed;
  named.of_echoes = std::move(of_echoes);
  return {named, station};
}

/// 40,000 rays from the middle of a ball: all ranges are equal, all surfaces face the scanner.
Station inside() { return {.name = "s", .position = {}, .raster = raster(400, 100, -60, 60)}; }
std::vector<SceneObject> ball(double radius, Rgb color = kWhite) {
  return {object(make_sphere(radius), {}, color)};
}

struct Moments {
  double mean = 0, variance = 0;
  double count = 0;
};
Moments moments(const std::vector<double>& values) {
  Moments m{.count = static_cast<double>(values.size())};
  for (const double value : values) m.mean += value / m.count;
  for (const double value : values) m.variance += (value - m.mean) * (value - m.mean) / m.count;
  return m;
}
/// The mean of n normal numbers has the deviation sigma / sqrt(n); their variance has sigma^2 sqrt(2 / n), the
/// normal limit of chi-square.
void expect_normal(const std::vector<double>& values, double sigma) {
  const Moments m = moments(values);
  EXPECT_LT(std::fabs(m.mean), kDeviations * sigma / std::sqrt(m.count));
  EXPECT_LT(std::fabs(m.variance / (sigma * sigma) - 1), kDeviations * std::sqrt(2 / m.count));
}
/// The number of successes is binomial.
void expect_share(std::size_t found, std::size_t of, double probability) {
  const auto count = static_cast<double>(of);
  EXPECT_LT(std::fabs(static_cast<double>(found) - count * probability),
            kDeviations * std::sqrt(count * probability * (1 - probability)) + 1e-9)
      << found << " of " << of;
}
std::vector<double> ranges(const Scan& found) {
  std::vector<double> lengths;
  for (const Vector3& point : found.points) lengths.push_back(length(point));
  return lengths;
}

TEST(Random, PhiloxGivesTheKnownAnswersOfItsAuthors) {
  // Random123, tests/kat_vectors: philox4x32 10.
  using Words = std::array<std::uint32_t, 4>;
  constexpr std::uint32_t kOnes = 0xffffffff;
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}),
            (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({kOnes, kOnes, kOnes, kOnes}, {kOnes, kOnes}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, NumbersHaveTheirMomentsAndTellSeedStationEffectRayAndDrawApart) {
  const Draws draws(1, 2, 3);
  std::vector<double> uniform, normal, products;
  for (std::uint64_t ray = 0; ray < 50'000; ++ray) {
    for (const double u : draws.uniform(ray)) uniform.push_back((u - 0.5) * std::sqrt(12.0));
    const auto [a, b] = draws.normal(ray);
    normal.insert(normal.end(), {a, b});
    products.push_back(a * b);
  }
  // The fourth moment of a uniform number is less than a normal one's, so the interval holds for it too.
  expect_normal(uniform, 1);
  expect_normal(normal, 1);
  EXPECT_LT(std::fabs(moments(products).mean), kDeviations / std::sqrt(50'000.0));
  const auto told = draws.uniform(5, 1);
  for (const auto& other :
       {Draws(2, 2, 3).uniform(5, 1), Draws(1, 3, 3).uniform(5, 1), Draws(1, 2, 4).uniform(5, 1),
        draws.uniform(6, 1), draws.uniform(5, 2), draws.uniform(5 + (std::uint64_t{1} << 32), 1),
        Draws(1 + (std::uint64_t{1} << 32), 2, 3).uniform(5, 1)})
    EXPECT_NE(told, other);
}

TEST(Effects, NoneNamedIsTheIdealScannerAndCallsNothing) {
  const Scan ideal = scan(ball(5), inside());
  const Scan none = scan(ball(5), inside(), {}, effects({}));
  EXPECT_EQ(none.effect_calls, EffectCalls{});
  EXPECT_TRUE(none.bytes == ideal.bytes);
}

TEST(Effects, OnlyTheNamedAreCalledOnceARay) {
  EffectCalls expected{};
  expected[static_cast<std::size_t>(EffectKind::kRangeNoise)] = 40'000;
  EXPECT_EQ(scan(ball(5), inside(), {}, effects({noise(0.01, 0)})).effect_calls, expected);
}

std::vector<ChosenEffect> all_effects() {
  return {divergence(0.05, 0.5, 5), foliage(3, 0.5),  noise(0.01, 1e-3),
          jitter(0.1, 0.1),         dropouts(5, 4),   dust(50),
          outliers(0.01),           falloff(3, 0.01), exposure(1, 0.3)};
}

TEST(Effects, TheSameBytesOnAnyNumberOfThreadsAndInAnyOrderOfNames) {
  auto named = all_effects();
  std::vector<SceneObject> objects = ball(5);
  for (const double x : {2.0, 3.0}) {
    objects.push_back(object(make_sphere(1.5), {x, 0, 0}, kWhite));
    objects.back().leaf_area_density = 0.5;
  }
  const Scan one = scan(objects, inside(), {.threads = 1}, effects(named));
  EXPECT_GT(one.told, 10'000U);
  for (const unsigned threads : {2U, 7U})
    EXPECT_TRUE(scan(objects, inside(), {.threads = threads}, effects(named)).bytes == one.bytes);
  std::reverse(named.begin(), named.end());
  EXPECT_TRUE(scan(objects, inside(), {}, effects(named)).bytes == one.bytes);
}

TEST(Effects, OtherSeedsAndStationsDrawOtherNumbers) {
  const auto points = [](std::size_t station, std::uint64_t seed) {
    return scan(ball(5), inside(), {}, effects({noise(0.01, 0)}, station, seed)).points;
  };
  EXPECT_NE(points(0, 0), points(1, 0));
  EXPECT_NE(points(0, 0), points(0, 1));
}

TEST(Effects, AddingOneLeavesTheValuesOfOthers) {
  const Scan noisy = scan(ball(5), inside(), {}, effects({noise(0.01, 1e-3)}));
  const Scan more =
      scan(ball(5), inside(), {},
           effects({noise(0.01, 1e-3), jitter(0.1, 0.1), falloff(3, 0.01), exposure(1, 0.3)}));
  ASSERT_EQ(more.told, noisy.told);
  for (std::size_t i = 0; i < noisy.points.size(); ++i)
    ASSERT_NEAR(length(more.points[i]), length(noisy.points[i]), 1e-13);
  // Those that take echoes take whole ones: what is left stands in the longer list unchanged.
  const Scan fewer = scan(ball(5), inside(), {}, effects({noise(0.01, 1e-3), dropouts(1, 5)}));
  EXPECT_LT(fewer.told, noisy.told);
  std::size_t at = 0;
  for (const Vector3& point : fewer.points) {
    while (at < noisy.points.size() && noisy.points[at] != point) ++at;
    ASSERT_LT(at++, noisy.points.size());
  }
}

TEST(RangeNoise, GrowsWithTheDistance) {
  for (const double radius : {2.0, 50.0}) {
    const Scan found = scan(ball(radius), inside(), {}, effects({noise(0.003, 2e-4)}));
    ASSERT_EQ(found.told, 40'000U);
    std::vector<double> errors;
    for (const double range : ranges(found)) errors.push_back(range - radius);
    expect_normal(errors, std::hypot(0.003, 2e-4 * radius));
  }
}

TEST(RangeNoise, GrowsWithTheAngleOfIncidenceUpToABound) {
  // A floor 2 below: the incidence is the zenith angle.
  Station station{.name = "s", .position = {0, 0, 2}};
  for (const double elevation : {-80.0, -30.0, -2.0}) {
    station.raster = raster(20'000, 1, elevation - 1e-6, elevation + 1e-6);
    const double sine = std::sin(-elevation * kDegree);
    const Scan found =
        scan({object(make_plane(500, 500), {})}, station, {}, effects({noise(0.01, 0)}));
    std::vector<double> errors;
    for (const double range : ranges(found)) errors.push_back(range - 2 / sine);
    ASSERT_EQ(errors.size(), 20'000U);
    // The raster is 2e-6 degrees high, which moves ranges by less than 1e-7 of them.
    expect_normal(errors, 0.01 / std::max(sine, 0.1));
  }
}

TEST(AngularJitter, MovesBothAnglesAndKeepsRanges) {
  const Scan ideal = scan(ball(5), inside());
  const Scan found = scan(ball(5), inside(), {}, effects({jitter(0.02, 0.05)}));
  ASSERT_EQ(found.told, ideal.told);
  std::vector<double> azimuths, elevations;
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    const auto &p = ideal.points[i], &q = found.points[i];
    EXPECT_NEAR(length(q), 5, 1e-12);
    azimuths.push_back(
        std::remainder(std::atan2(q[1], q[0]) - std::atan2(p[1], p[0]), 2 * std::numbers::pi));
    elevations.push_back(std::asin(q[2] / 5) - std::asin(p[2] / 5));
  }
  expect_normal(azimuths, 0.02 * kDegree);
  expect_normal(elevations, 0.05 * kDegree);
}

TEST(IntensityFalloff, FollowsTheLaserRadarEquation) {
  // sRGB 128 is 0.21586 of the light (IEC 61966-2-1).
  const Scan found = scan(ball(8, {128, 128, 128}), inside(), {}, effects({falloff(4, 0.02)}));
  const double expected = 65535 * 0.21586 * 0.25 * std::exp(-2 * 0.02 * 4);
  for (const std::uint16_t intensity : found.intensities) ASSERT_NEAR(intensity, expected, 1);
  for (const std::uint16_t intensity :
       scan(ball(2), inside(), {}, effects({falloff(4, 0)})).intensities)
    ASSERT_EQ(intensity, 65535);
}

TEST(Dropouts, GrowWithRangeDarknessAndIncidence) {
  const auto kept = [](double radius, Rgb color) {
    return scan(ball(radius, color), inside(), {}, effects({dropouts(2, 10)})).told;
  };
  expect_share(kept(10, kWhite), 40'000, 1 - std::exp(-2));
  expect_share(kept(20, kWhite), 40'000, 1 - std::exp(-0.5));
  expect_share(kept(10, {128, 128, 128}), 40'000, 1 - std::exp(-2 * 0.21586));
  EXPECT_EQ(kept(10, {0, 0, 0}), 0U);
  Station station{
      .name = "s", .position = {0, 0, 5}, .raster = raster(40'000, 1, -30.001, -29.999)};
  const Scan floor =
      scan({object(make_plane(50, 50), {}, kWhite)}, station, {}, effects({dropouts(2, 10)}));
  expect_share(floor.told, 40'000, 1 - std::exp(-2 * 0.5));  // at 10, under 60 degrees
}

TEST(Dust, IsMetAfterAnExponentialWay) {
  const Scan found = scan(ball(30), inside(), {}, effects({dust(20)}));
  ASSERT_EQ(found.told, 40'000U);
  std::size_t met = 0, within_ten = 0;
  for (const double range : ranges(found)) {
    met += range < 30 - 1e-9;
    within_ten += range < 10;
  }
  expect_share(met, 40'000, 1 - std::exp(-1.5));
  expect_share(within_ten, 40'000, 1 - std::exp(-0.5));
  // Also where the scene holds nothing, up to the range of the scanner.
  const Scan sky = scan(ball(1000), inside(), {}, effects({dust(200)}));
  expect_share(sky.told, 40'000, 1 - std::exp(-0.5));
}

TEST(Outliers, AreARandomShareAnywhereInTheRange) {
  const Scan found = scan(ball(1000), inside(), {}, effects({outliers(0.1)}));
  expect_share(found.told, 40'000, 0.1);
  std::size_t near = 0;
  for (const double range : ranges(found)) near += range < 25;
  expect_share(near, found.told, 0.25);
  EXPECT_EQ(scan(ball(5), inside(), {}, effects({outliers(0.1)})).told, 40'000U);
}

TEST(Exposure, ScalesTheLightOfAStationAndClips) {
  const Exposure settings{.exposure = 1.5, .white_balance = 0.5};
  std::vector<double> first, difference;
  for (std::uint32_t station = 0; station < 4000; ++station) {
    const auto gains = settings.gains(Draws(0, station, 1));
    first.push_back(std::log2(gains[0]));
    difference.push_back(std::log2(gains[0] / gains[2]));
  }
  expect_normal(first, std::hypot(1.5, 0.5));
  expect_normal(difference, 0.5 * std::sqrt(2));
  // No balance: twice the light of 100 is 138 by the curve of sRGB, and all channels have the same gain.
  const Scan same = scan(ball(5, {100, 100, 100}), inside(), {}, effects({exposure(1, 0)}));
  const Scan other = scan(ball(5, {100, 100, 100}), inside(), {}, effects({exposure(1, 0)}, 1));
  for (const Scan* found : {&same, &other})
    for (const Rgb& color : found->colors) {
      ASSERT_EQ(color, found->colors.front());
      ASSERT_EQ(color, (Rgb{color[0], color[0], color[0]}));
    }
  EXPECT_NE(same.colors.front(), other.colors.front());
  const auto developed = [](std::uint8_t value, double gain) {
    const double light = gain * std::pow((value / 255.0 + 0.055) / 1.055, 2.4);
    return std::lround(255 * std::min(1.0, 1.055 * std::pow(light, 1 / 2.4) - 0.055));
  };
  const double gain =
      Exposure{1, 0}.gains(Draws(0, 0, static_cast<std::uint32_t>(EffectKind::kExposure)))[0];
  EXPECT_EQ(same.colors.front()[0], developed(100, gain));
}

TEST(RegistrationError, MovesTheRecordedPoseAndCastsFromTheTrueOne) {
  Effects named;
  named.registration_error = {.translation = 0.05, .rotation = 0.2};
  const Station station{
      .name = "s", .position = {1, 2, 3}, .turn = turned(30, 5, 0), .raster = raster(60, 40)};
  std::vector<double> shifts, angles;
  for (std::size_t i = 0; i < 3000; ++i) {
    const Station told = StationEffects(named, i).recorded(station);
    for (const double shift : told.position - station.position) shifts.push_back(shift);
    const auto turn =
        product({station.turn[0], -station.turn[1], -station.turn[2], -station.turn[3]}, told.turn);
    // Of a small turn by the angles a about the axes the quaternion is about (1, a / 2).
    for (std::size_t axis = 1; axis < 4; ++axis) angles.push_back(2 * turn[axis]);
  }
  expect_normal(shifts, 0.05);
  expect_normal(angles, 0.2 * kDegree);
  const StationEffects moved(named, 0);
  const std::vector<SceneObject> objects{object(make_box({9, 8, 7}), {1, 1, 2})};
  // In its own frame the scan is the ideal one; in the world it lies where the survey puts it.
  const Scan own = scan(objects, station, {}, moved);
  EXPECT_TRUE(own.bytes == scan(objects, station).bytes);
  const Scan world = scan(objects, station, {.frame = ScanFrame::kWorld}, moved);
  const formats::Pose told = moved.recorded(station).pose();
  ASSERT_EQ(world.told, own.told);
  for (std::size_t i = 0; i < own.points.size(); ++i)
    ASSERT_LT(length(world.points[i] - formats::place(told, own.points[i])), 1e-12);
  EXPECT_EQ(own.effect_calls[static_cast<std::size_t>(EffectKind::kRegistrationError)], 1U);
}

/// A beam of rays that all look along x, but for less than 1e-3 degrees.
Station along_x(std::uint64_t rays) {
  Station station{.name = "s", .position = {}, .raster = raster(rays, 1, -1e-6, 1e-6)};
  station.raster.azimuth_begin = -1e-3;
  station.raster.azimuth_end = 1e-3;
  return station;
}
/// A box from `near` to `far` along x.
SceneObject slab(double near, double far, double leaf_area_density = 0) {
  SceneObject result = object(make_box({far - near, 9, 9}), {(near + far) / 2, 0, 0}, kWhite);
  result.leaf_area_density = leaf_area_density;
  return result;
}
std::size_t count_within(const Scan& found, double near, double far) {
  return static_cast<std::size_t>(
      std::count_if(found.points.begin(), found.points.end(),
                    [&](const Vector3& p) { return p[0] > near && p[0] < far; }));
}

/// A wall at x = 10 where y is negative, one at 10.5 elsewhere, and azimuths up to 0.5 degrees about the edge.
std::vector<SceneObject> edge() {
  return {object(make_box({1, 100, 100}), {10.5, -50, 0}, kWhite),
          object(make_box({1, 200, 100}), {11, 0, 0}, kWhite)};
}
Station before_edge() {
  Station station = along_x(201);
  station.raster.azimuth_begin = -0.5;
  station.raster.azimuth_end = 0.5;
  return station;
}

TEST(BeamDivergence, MixesTheRangesOfAnEdgeByTheGaussianOfTheBeam) {
  const Scan found = scan(edge(), before_edge(), {}, effects({divergence(0.4, 1, 1000)}));
  ASSERT_EQ(found.told, 201U);
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    // Across one axis exp(-2 a^2 / (0.2 degrees)^2) is a normal distribution of deviation 0.1 degrees.
    const double azimuth = before_edge().raster.azimuth(i);
    const double front = 0.5 * std::erfc(azimuth / 0.1 / std::sqrt(2.0)) / (10 * 10);
    const double back = 0.5 * std::erfc(-azimuth / 0.1 / std::sqrt(2.0)) / (10.5 * 10.5);
    EXPECT_NEAR(length(found.points[i]), (10 * front + 10.5 * back) / (front + back), 0.01) << i;
  }
}

TEST(BeamDivergence, TellsSurfacesApartThatLieFartherThanItsResolution) {
  const Scan found = scan(edge(), before_edge(), {}, effects({divergence(0.4, 0.3, 50)}));
  ASSERT_EQ(found.told, 201U);
  for (const double range : ranges(found))
    EXPECT_LT(std::min(std::fabs(range - 10), std::fabs(range - 10.5)), 1e-3);
}

TEST(BeamDivergence, WidensWhatIsThinnerThanTheBeamAndKeepsWhatIsEven) {
  const std::vector<SceneObject> wire{object(make_tube({{10, 0, -5}, {10, 0, 5}}, 0.002), {})};
  const std::uint64_t ideal = scan(wire, before_edge()).told;
  EXPECT_GT(scan(wire, before_edge(), {}, effects({divergence(0.4, 1, 50)})).told, 5 * ideal);
  for (const double range : ranges(scan(ball(5), inside(), {}, effects({divergence(0.4, 1, 7)}))))
    ASSERT_NEAR(range, 5, 1e-12);
}

TEST(Foliage, LetsThroughWhatBeerAndLambertSay) {
  const std::vector<SceneObject> objects{slab(5, 9, 0.6), slab(12, 13)};
  const Scan first = scan(objects, along_x(20'000), {}, effects({foliage(1, 1)}));
  ASSERT_EQ(first.told, 20'000U);
  EXPECT_EQ(count_within(first, 4.9, 9) + count_within(first, 11.999, 12.001), 20'000U);
  expect_share(count_within(first, 11, 13), 20'000, std::exp(-0.5 * 0.6 * 4));
  expect_share(count_within(first, 4.9, 6), 20'000, 1 - std::exp(-0.5 * 0.6 * 1));
  // Overlapping crowns add their densities; a trunk inside is seen, what is behind it is not.
  const Scan both = scan({slab(5, 9, 0.4), slab(7, 10, 0.2), slab(12, 13)}, along_x(20'000), {},
                         effects({foliage(1, 1)}));
  expect_share(count_within(both, 11, 13), 20'000, std::exp(-0.5 * (0.4 * 4 + 0.2 * 3)));
  const Scan trunk = scan({slab(5, 9, 0.4), slab(7, 8), slab(12, 13)}, along_x(20'000), {},
                          effects({foliage(1, 1)}));
  expect_share(count_within(trunk, 6.999, 7.001), 20'000, std::exp(-0.5 * 0.4 * 2));
  EXPECT_EQ(count_within(trunk, 7.001, 99), 0U);
}

TEST(Foliage, GivesSeveralReturnsWhoseNumberIsPoissons) {
  const std::vector<SceneObject> objects{slab(5, 9, 0.6), slab(12, 13)};
  const Scan found = scan(objects, along_x(20'000), {}, effects({foliage(15, 0.25)}));
  EXPECT_EQ(count_within(found, 11, 13), 20'000U);
  const double mean = 0.5 * 0.6 * 4;
  EXPECT_LT(std::fabs(static_cast<double>(count_within(found, 4, 10)) - 20'000 * mean),
            kDeviations * std::sqrt(20'000 * mean));
  // The first of each beam has a quarter of the light, the next a quarter of what is left, or all if solid.
  EXPECT_EQ(found.intensities[0], found.points[0][0] < 11 ? std::lround(65535 * 0.25) : 65535);
  for (std::size_t i = 1; i < found.points.size(); ++i)
    if (found.points[i - 1][0] > 11 && found.points[i][0] < 11)
      ASSERT_EQ(found.intensities[i], std::lround(65535 * 0.25));
  // All returns of a beam are told together, and counted, the wall as the last.
  ASSERT_EQ(found.return_numbers.size(), found.points.size());
  std::uint8_t last = 0;
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    ASSERT_EQ(found.return_numbers[i], ++last);
    if (found.return_counts[i] != last) continue;
    ASSERT_GT(found.points[i][0], 11);
    last = 0;
  }
  EXPECT_LE(scan(objects, along_x(20'000), {}, effects({foliage(2, 0.25)})).told, 40'000U);
}

TEST(Foliage, MayTouchFoliageAndWhatIsSolid) {
  const SceneObject near = slab(5, 9, 0.4), far = slab(9, 13, 0.2), wall = slab(20, 21);
  for (const auto& objects : {std::vector{near, far, wall}, std::vector{far, wall, near}}) {
    const Scan hedge = scan(objects, along_x(20'000), {}, effects({foliage(1, 1)}));
    expect_share(count_within(hedge, 19, 21), 20'000, std::exp(-0.5 * (0.4 * 4 + 0.2 * 4)));
    EXPECT_EQ(count_within(hedge, 13, 19.9), 0U);
  }
  for (const auto& objects : {std::vector{near, slab(9, 10)}, std::vector{slab(9, 10), near}}) {
    const Scan before_wall = scan(objects, along_x(20'000), {}, effects({foliage(1, 1)}));
    EXPECT_EQ(before_wall.told, 20'000U);
    EXPECT_EQ(count_within(before_wall, 9 + 1e-6, 99), 0U);
    expect_share(count_within(before_wall, 9 - 1e-9, 9 + 1e-6), 20'000, std::exp(-0.5 * 0.4 * 4));
  }
}

TEST(Foliage, HasTheWayThroughItsShape) {
  // Along a diameter, along the axis of a lying cylinder, and from a station inside a box.
  SceneObject crown = object(make_sphere(1.5), {5, 0, 0}, kWhite);
  SceneObject hedge = object(make_cylinder(2, 3), {10, 0, 0}, kWhite);
  hedge.pose = pose_at({10, 0, 0}, turned(0, 90, 0));
  SceneObject around = object(make_box({4, 4, 4}), {}, kWhite);
  const auto share_through = [](SceneObject leafy) {
    leafy.leaf_area_density = 0.4;
    return count_within(scan({leafy, slab(20, 21)}, along_x(20'000), {}, effects({foliage(1, 1)})),
                        19, 21);
  };
  expect_share(share_through(crown), 20'000, std::exp(-0.5 * 0.4 * 3));
  expect_share(share_through(hedge), 20'000, std::exp(-0.5 * 0.4 * 3));
  expect_share(share_through(around), 20'000, std::exp(-0.5 * 0.4 * 2));
}

TEST(Foliage, IsNotWidenedByTheBeam) {
  const auto leaves = [](std::vector<ChosenEffect> named) {
    return scan({slab(5, 9, 0.6)}, along_x(20'000), {}, effects(std::move(named)));
  };
  const Scan alone = leaves({foliage(1, 1)});
  expect_share(alone.told, 20'000, 1 - std::exp(-0.5 * 0.6 * 4));
  EXPECT_TRUE(leaves({foliage(1, 1), divergence(0.02, 0.3, 7)}).bytes == alone.bytes);
}

TEST(Foliage, IsSolidWhereItIsNotNamed) {
  EXPECT_TRUE(scan({slab(5, 9, 0.6)}, along_x(100)).bytes ==
              scan({slab(5, 9)}, along_x(100)).bytes);
}

TEST(MovingObjects, AreWhereTheyAreWhenTheRayIsCast) {
  SceneObject walker = object(make_sphere(1), {10, -2, 0}, {9, 9, 9});
  walker.walk = {0, 4, 0};
  walker.walk_time = 100;
  Station station = along_x(2000);
  station.raster.azimuth_begin = -30;
  station.raster.azimuth_end = 30;
  Effects named;
  named.moving_objects = {.scan_time = 50};
  const std::vector<SceneObject> objects{slab(12, 13), walker};
  // It goes there while the first station is scanned, and back while the second is.
  for (const std::size_t number : {0U, 1U}) {
    const Scan found = scan(objects, station, {}, {named, number});
    std::size_t seen = 0;
    for (std::size_t i = 0; i < found.points.size(); ++i) {
      if (found.colors[i] != walker.paint.first) continue;
      ++seen;
      const Vector3& p = found.points[i];
      const double share = (std::atan2(p[1], p[0]) / kDegree + 30) / 60 - 0.5 / 2000;
      const double way = 4 * (number == 0 ? share : 1 - share);
      EXPECT_NEAR(length(p - Vector3{10, -2 + way, 0}), 1, 1e-9);
    }
    // Azimuth and object run the same way, which widens it; the other way it is narrower.
    const double still = 2 * std::asin(0.1) / kDegree / 60 * 2000;
    EXPECT_GT(seen, 100U);
    EXPECT_EQ(number == 0, static_cast<double>(seen) > still);
    EXPECT_EQ(found.effect_calls[static_cast<std::size_t>(EffectKind::kMovingObjects)], 2000U);
  }
  SceneObject still = walker;
  still.walk = {};
  EXPECT_TRUE(scan(objects, station).bytes == scan({slab(12, 13), still}, station).bytes);
}

}  // namespace
}  // namespace cairn::stages
