// The simulated scanner against formulas: directions of its raster, ranges, normals, intensities and colours of
// simple scenes, near the origin and far from it.
#include "stages/simulate/scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "formats/error.h"
#include "stages/parallel.h"
#include "tests/stages/simulate/simulated_scan.h"

namespace cairn::stages {
namespace {

TEST(Scanner, RaysGoThroughTheMiddlesOfTheRastersCellsColumnByColumn) {
  Station station{.name = "s", .position = {1, 2, 3}, .raster = raster(8, 5)};
  const Scan inside = scan({object(make_sphere(4), {1, 2, 3})}, station);
  ASSERT_EQ(inside.points.size(), 40U);
  EXPECT_EQ(inside.told, 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    const double azimuth =
        (-180 + 45 * (static_cast<double>(i / 5) + 0.5)) * std::numbers::pi / 180;
    const double elevation =
        (-60 + 24 * (static_cast<double>(i % 5) + 0.5)) * std::numbers::pi / 180;
    const Vector3 expected{4 * std::cos(elevation) * std::cos(azimuth),
                           4 * std::cos(elevation) * std::sin(azimuth), 4 * std::sin(elevation)};
    EXPECT_LT(length(inside.points[i] - expected), 1e-12) << i;
    EXPECT_EQ(inside.intensities[i], 65535);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(inside.normals[i][axis], -expected[axis] / 4, 1e-6);
  }
}

TEST(Scanner, ATurnedStationTellsPointsInItsOwnFrameOrInTheWorld) {
  Station station{.name = "s",
                  .position = {10, 0, 5},
                  .turn = turned(90, 30, 0),
                  .raster = raster(1, 1, -1e-9, 1e-9)};
  station.raster.azimuth_begin = -1e-9;
  station.raster.azimuth_end = 1e-9;
  // Its x axis looks along (0, cos 30, sin 30).
  const std::vector<SceneObject> objects{object(make_box({4, 2, 40}), {10, 9, 5})};
  const double range = 8 / std::cos(std::numbers::pi / 6);
  const Scan own = scan(objects, station);
  ASSERT_EQ(own.points.size(), 1U);
  EXPECT_LT(length(own.points[0] - Vector3{range, 0, 0}), 1e-9);
  EXPECT_NEAR(own.normals[0][0], -std::cos(std::numbers::pi / 6), 1e-6);
  EXPECT_NEAR(own.normals[0][2], std::sin(std::numbers::pi / 6), 1e-6);
  EXPECT_EQ(own.intensities[0], std::lround(65535 * std::cos(std::numbers::pi / 6)));
  const Scan world = scan(objects, station, {.frame = ScanFrame::kWorld});
  EXPECT_LT(length(world.points[0] - Vector3{10, 8, 5 + 8 * std::tan(std::numbers::pi / 6)}), 1e-9);
  EXPECT_NEAR(world.normals[0][1], -1, 1e-6);
}

TEST(Scanner, RollTurnsAboutTheHeading) {
  const formats::Pose pose = pose_at({}, turned(0, 0, 90));
  EXPECT_LT(length(formats::place(pose, {0, 1, 0}) - Vector3{0, 0, 1}), 1e-15);
  EXPECT_EQ(formats::place(pose, {1, 0, 0}), (Vector3{1, 0, 0}));
}

TEST(Scanner, FarFromTheOriginPointsStillLieOnTheirSurfaces) {
  const Vector3 far{500123.456, 5700321.987, 321.125};
  const std::vector<SceneObject> objects{
      object(make_plane(200, 200), far), object(make_sphere(1.5), far + Vector3{20, 5, 2}),
      object(make_tube({{0, 0, 0}, {0, 0, 9}}, 0.04), far + Vector3{30, -3, 0})};
  Station station{.name = "s", .position = far + Vector3{0, 0, 2}, .raster = raster(3000, 60)};
  const Scan found = scan(objects, station);
  std::array<int, 3> counts{};
  for (const Vector3& p : found.points) {
    const double plane = std::fabs(p[2] + 2);
    const double sphere = std::fabs(length(p - Vector3{20, 5, 0}) - 1.5);
    const double wire = std::fabs(std::hypot(p[0] - 30, p[1] + 3) - 0.04);
    const double least = std::min({plane, sphere, wire});
    // The tops of the coordinates have steps of 1e-9.
    EXPECT_LT(least, 1e-8);
    ++counts[least == plane ? 0 : least == sphere ? 1 : 2];
  }
  EXPECT_GT(counts[0], 50000);
  EXPECT_GT(counts[1], 100);
  EXPECT_GE(counts[2], 1);
}

TEST(Scanner, NothingBeyondTheRangeIsSeen) {
  Station station{.name = "s", .position = {}, .raster = raster(100, 1, -1, 1), .max_range = 10};
  EXPECT_EQ(scan({object(make_sphere(9.999), {})}, station).points.size(), 100U);
  EXPECT_EQ(scan({object(make_sphere(10.001), {})}, station).points.size(), 0U);
}

TEST(Scanner, OfSurfacesInOnePlaceTheFirstIsSeen) {
  Station station{.name = "s", .position = {0, 0, 3}, .raster = raster(500, 40, -80, -20)};
  const SceneObject a = object(make_plane(40, 40), {}, {10, 0, 0});
  const SceneObject b = object(make_plane(30, 30), {}, {0, 20, 0});
  for (const Rgb& color : scan({a, b}, station).colors) ASSERT_EQ(color, (Rgb{10, 0, 0}));
  const Scan other = scan({b, a}, station);
  int first = 0;
  for (std::size_t i = 0; i < other.points.size(); ++i) {
    const bool covered = std::fabs(other.points[i][0]) <= 15 && std::fabs(other.points[i][1]) <= 15;
    ASSERT_EQ(other.colors[i], covered ? (Rgb{0, 20, 0}) : (Rgb{10, 0, 0}));
    first += covered;
  }
  EXPECT_GT(first, 1000);
}

std::vector<SceneObject> many_objects() {
  std::vector<SceneObject> objects{object(make_plane(50, 50), {0, 0, -1})};
  for (int i = 0; i < 200; ++i)
    objects.push_back(
        object(i % 2 == 0 ? make_sphere(0.5) : make_box({0.7, 0.5, 2}),
               {8 * std::cos(i * 0.7) + i * 0.01, 9 * std::sin(i * 0.7), 0.1 * (i % 9)},
               {static_cast<std::uint8_t>(i), 0, 0}));
  formats::Mesh mesh;
  for (int i = 0; i <= 40; ++i)
    for (int k = 0; k <= 40; ++k)
      mesh.vertices.push_back({i * 0.25 - 5, k * 0.25 - 5, 2 + 0.1 * std::sin(i * k)});
  for (std::uint32_t i = 0; i < 40; ++i)
    for (std::uint32_t k = 0; k < 40; ++k) {
      const std::uint32_t at = i * 41 + k;
      mesh.triangles.push_back({at, at + 1, at + 42});
      mesh.triangles.push_back({at, at + 42, at + 41});
    }
  objects.push_back(object(make_mesh(mesh), {}));
  return objects;
}

TEST(Scanner, TheSameBytesOnAnyNumberOfThreadsAndEveryRun) {
  const auto objects = many_objects();
  Station station{.name = "s", .position = {0.1, 0.2, 0.3}, .raster = raster(700, 211, -60, 90)};
  const Scan one = scan(objects, station, {.threads = 1});
  EXPECT_GT(one.points.size(), 100000U);
  for (const unsigned threads : {1U, 2U, 7U})
    EXPECT_TRUE(scan(objects, station, {.threads = threads}).bytes == one.bytes) << threads;
}

TEST(Scanner, TheHierarchyFindsWhatBruteForceFinds) {
  const auto objects = many_objects();
  Station station{.name = "s", .position = {0.1, 0.2, 0.3}, .raster = raster(60, 40, -60, 90)};
  const Scan found = scan(objects, station);
  std::size_t next = 0;
  for (std::uint64_t ray = 0; ray < station.raster.rays(); ++ray) {
    const double azimuth = station.raster.azimuth(ray / 40) * std::numbers::pi / 180;
    const double elevation = station.raster.elevation(ray % 40) * std::numbers::pi / 180;
    const Vector3 direction{std::cos(elevation) * std::cos(azimuth),
                            std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
    double nearest = kNoHit;
    for (const SceneObject& o : objects)
      for (std::size_t piece = 0; piece < o.shape->pieces(); ++piece)
        nearest = std::min(
            nearest, o.shape->intersect(piece, {station.position - o.pose.translation, direction}));
    if (nearest > station.max_range) continue;
    ASSERT_LT(next, found.points.size());
    EXPECT_NEAR(length(found.points[next++]), nearest, 1e-9) << ray;
  }
  EXPECT_EQ(next, found.points.size());
}

TEST(Scanner, StepsAreTheCoordinatesRounded) {
  Station station{.name = "s", .position = {500000.25, 10, 3}, .raster = raster(50, 10)};
  const std::vector<SceneObject> objects{object(make_sphere(7), station.position)};
  const Scan exact = scan(objects, station, {.frame = ScanFrame::kWorld});
  const Scan rounded = scan(objects, station, {.frame = ScanFrame::kWorld, .steps = true});
  const auto description = describe_station(station, ScanFrame::kWorld, true);
  EXPECT_EQ(description.offset, (std::array<double, 3>{500000, 10, 3}));
  ASSERT_EQ(rounded.steps.size(), exact.points.size());
  for (std::size_t i = 0; i < exact.points.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(description.offset[axis] + 1e-5 * rounded.steps[i][axis], exact.points[i][axis],
                  0.51e-5);
  station.max_range = 1e6;
  EXPECT_DOUBLE_EQ(describe_station(station, ScanFrame::kSensor, true).scale[0], 1e-3);
}

TEST(Scanner, RastersScaleToTheNumberOfPointsAskedFor) {
  Scene scene{.objects = {object(make_plane(30, 30), {0, 0, -2})}, .stations = {}};
  for (const double x : {0.0, 5.0})
    scene.stations.push_back(
        {.name = "s", .position = {x, 0, 0}, .raster = raster(90, 60, -90, 90)});
  const Context context{.threads = 2};
  scale_to_points(context, 200'000, {}, scene);
  std::uint64_t points = 0;
  for (const Station& station : scene.stations) points += scan(scene.objects, station).told;
  EXPECT_NEAR(static_cast<double>(points), 200'000, 8'000);
  // The shape of the cells stays.
  EXPECT_NEAR(static_cast<double>(scene.stations[0].raster.columns) /
                  static_cast<double>(scene.stations[0].raster.rows),
              1.5, 0.01);
  EXPECT_THROW(scale_to_points(context, 1'000'000'000'000, {}, scene), formats::Error);
  scene.objects[0].pose.translation = {0, 0, 500};
  EXPECT_THROW(scale_to_points(context, 1000, {}, scene), formats::Error);
}

TEST(Scanner, PatternsColourObjectsInTheirOwnFrames) {
  const Box extent{{-1, -1, -2}, {1, 1, 2}};
  const Paint gradient{
      .pattern = Pattern::kGradient, .first = {0, 100, 200}, .second = {200, 100, 0}};
  EXPECT_EQ(color_at(gradient, extent, {0, 0, -2}, {0, 0, -1}), (Rgb{0, 100, 200}));
  EXPECT_EQ(color_at(gradient, extent, {1, 0, 1}, {1, 0, 0}), (Rgb{150, 100, 50}));
  const Paint checker{
      .pattern = Pattern::kChecker, .first = {1, 1, 1}, .second = {9, 9, 9}, .cube_size = 0.5};
  // The top of a layer of cubes: below z = 0, whose cube of (0.1, 0.1) is odd.
  EXPECT_EQ(color_at(checker, extent, {0.1, 0.1, 0}, {0, 0, 1}), (Rgb{9, 9, 9}));
  EXPECT_EQ(color_at(checker, extent, {0.6, 0.1, 0}, {0, 0, 1}), (Rgb{1, 1, 1}));
  EXPECT_EQ(color_at(checker, extent, {-0.1, 0.1, 1e-15}, {0, 0, 1}), (Rgb{1, 1, 1}));
  EXPECT_EQ(color_at(checker, extent, {-0.1, 0.1, -1e-15}, {0, 0, 1}), (Rgb{1, 1, 1}));
}

TEST(Scanner, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  Station station{.name = "s", .position = {}, .raster = raster(100, 100)};
  const Context context{.threads = 2, .progress = nullptr, .stop = stop.get_token()};
  EXPECT_THROW(scan_station(context, {object(make_sphere(1), {})}, station, {}, ScanFrame::kSensor,
                            describe_station(station, ScanFrame::kSensor, false),
                            [](const formats::PointBlock&) {}),
               Stopped);
}

}  // namespace
}  // namespace cairn::stages
