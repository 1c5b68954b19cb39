#include "stages/import/import.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <thread>

#include "formats/bytes.h"
#include "formats/error.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;
using formats::PointBlock;
using formats::PositionEncoding;
using formats::ReduceRule;
using formats::ScalarType;
using formats::Schema;

PointBlock steps_block(std::vector<GridPoint> steps) {
  PointBlock block;
  block.count = steps.size();
  block.steps = std::move(steps);
  return block;
}

PointBlock world_block(std::vector<std::array<double, 3>> world) {
  PointBlock block;
  block.count = world.size();
  block.world = std::move(world);
  return block;
}

template <typename T>
void add_column(PointBlock& block, std::vector<T> values) {
  const auto bytes = std::as_bytes(std::span(values));
  block.columns.emplace_back(bytes.begin(), bytes.end());
}

class ImportTest : public test::StageFixture {
 protected:
  /// The world coordinates that the imported points have on the grid, in campaign order.
  static std::vector<formats::WorldPoint> world_of(const ImportedPoints& points) {
    std::vector<formats::WorldPoint> world;
    for (const RecordRun& run : points.runs)
      for (std::uint64_t i = 0; i < run.count; ++i)
        world.push_back(points.grid.world(points.maps[run.scan].map(
            points.array.bytes().data() + run.first_byte + i * points.stride)));
    return world;
  }
};

TEST_F(ImportTest, LasScalesBecomeTheGridAndNothingIsRounded) {
  Scans scans;
  // Offsets 12.34 and -7.6 lie a whole number of centimetres apart.
  scans.push_back(test::steps_scan({}, {steps_block({{1, 2, 3}, {INT32_MAX - 2000, 5, 6}})},
                                   {0.01, 0.01, 0.001}, {12.34, 0, 0}));
  scans.push_back(
      test::steps_scan({}, {steps_block({{-5, -2, 0}})}, {0.01, 0.01, 0.001}, {-7.6, 0, 0}));
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(points.grid.step, (std::array<double, 3>{0.01, 0.01, 0.001}));
  EXPECT_TRUE(points.maps[0].exact() && points.maps[1].exact());
  const auto p = points.maps[0].map(std::array<double, 3>{1, 2, 3});
  const auto q = points.maps[1].map(std::array<double, 3>{-5, -2, 0});
  EXPECT_EQ(std::int64_t{p[0]} - q[0], 1 + 5 + 1994);  // (12.34 + 7.6) / 0.01 = 1994
  EXPECT_EQ(points.box.min, (GridPoint{0, 0, 0}));
}

TEST_F(ImportTest, WholeMultiplesOfAScaleAreLosslessToo) {
  Scans scans;
  scans.push_back(test::steps_scan({}, {steps_block({{100, 0, 0}})}, {0.01, 0.01, 0.01}));
  scans.push_back(test::steps_scan({}, {steps_block({{1001, 0, 0}})}, {0.001, 0.001, 0.001}));
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(points.grid.step[0], 0.001);
  const auto world = world_of(points);
  EXPECT_DOUBLE_EQ(world[0][0], 1.0);
  EXPECT_DOUBLE_EQ(world[1][0], 1.001);
}

TEST_F(ImportTest, ScalesThatAreNearlyEqualAreNotTakenForOne) {
  const double near = static_cast<double>(0.01F);  // 2.2e-10 less than 0.01
  Scans scans;
  scans.push_back(
      test::steps_scan({}, {steps_block({{0, 0, 0}, {500000000, 0, 0}})}, {0.01, 0.01, 0.01}));
  scans.push_back(test::steps_scan({}, {steps_block({{500000000, 0, 0}})}, {near, near, near}));
  const ImportedPoints points = import_scans(scans, {}, context());
  const auto world = world_of(points);
  // As if the scales were one, the last would be 0.11 from its place.
  EXPECT_NEAR(world[1][0], 5e6, points.grid.step[0]);
  EXPECT_NEAR(world[2][0], near * 500000000, points.grid.step[0]);
  EXPECT_LT(points.grid.step[0], 0.01);
}

TEST_F(ImportTest, ScansWithoutAPointHaveNoSayInTheGrid) {
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat64, {}, {world_block({})}));
  scans.push_back(test::steps_scan({}, {steps_block({})}, {0.007, 0.007, 0.007}));
  scans.push_back(
      test::steps_scan({}, {steps_block({{1, 2, 3}, {100, 5, 6}})}, {0.01, 0.01, 0.01}));
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(points.grid.step, (std::array<double, 3>{0.01, 0.01, 0.01}));
  EXPECT_TRUE(points.maps[2].exact());
}

TEST_F(ImportTest, LasIntegersMaySpanAllOfInt32) {
  Scans scans;
  scans.push_back(test::steps_scan({}, {steps_block({{INT32_MIN, 0, 0}, {INT32_MAX, 0, 0}})}));
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(points.box.min[0], INT32_MIN);
  EXPECT_EQ(points.box.max[0], INT32_MAX);
}

TEST_F(ImportTest, FloatStepsArePowersOfTwoThatFitThirtyBits) {
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat32, {},
                                   {world_block({{0.25, -3, 1}, {100.5, 2, 1}, {7, 7, 7}})}));
  const ImportedPoints points = import_scans(scans, {}, context());
  const double step = points.grid.step[0];
  EXPECT_EQ(step, std::exp2(std::ceil(std::log2(100.25 / ((1 << 30) - 2)))));
  const auto world = world_of(points);
  EXPECT_EQ(world[0], (formats::WorldPoint{0.25, -3, 1}));
  EXPECT_NEAR(world[1][0], 100.5, step / 2);
}

TEST_F(ImportTest, DropsAndCountsPointsThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  PointBlock block = world_block({{1, 1, 1}, {nan, 0, 0}, {2, 2, 2}, {0, -inf, 0}, {3, 3, 3}});
  add_column<std::uint8_t>(block, {10, 11, 12, 13, 14});
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat64,
                                   {{"tag", ScalarType::kU8, 1, ReduceRule::kNone}}, {block}));
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(points.points, 3U);
  EXPECT_EQ(points.ledger[0].read, 5U);
  EXPECT_EQ(points.ledger[0].dropped(), 2U);
  std::vector<int> tags;
  for (std::uint64_t i = 0; i < 3; ++i)
    tags.push_back(std::to_integer<int>(points.array.bytes()[i * points.stride + 24]));
  EXPECT_EQ(tags, (std::vector<int>{10, 12, 14}));
}

TEST_F(ImportTest, RefusesACloudWithoutAUsablePoint) {
  Scans scans;
  scans.push_back(
      test::world_scan(PositionEncoding::kFloat64, {}, {world_block({{std::nan(""), 0, 0}})}));
  EXPECT_THROW(import_scans(scans, {}, context()), formats::Error);
}

TEST_F(ImportTest, OneStrayPointIsRefusedUnlessAResolutionIsGiven) {
  std::vector<std::array<double, 3>> cloud;
  for (int i = 0; i < 1000; ++i) cloud.push_back({i * 0.01, i * 0.02, 0});
  cloud.push_back({1e30, 0, 0});
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat64, {}, {world_block(cloud)}));
  try {
    import_scans(scans, {}, context());
    FAIL() << "a step of 1e21 was accepted";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("1e+30"), std::string::npos) << error.what();
  }
  EXPECT_EQ(import_scans(scans, {.drop = {}, .keep = {}, .resolution = 1e25}, context()).points,
            1001U);
}

TEST_F(ImportTest, APileOfEqualPointsDoesNotHideTheExtentOfTheOthers) {
  // Few points off the spot; and so few that no sample finds them.
  for (const std::size_t pile : {2000U, 300'001U}) {
    std::vector<std::array<double, 3>> cloud(pile, {0, 0, 0});
    cloud[1] = {1, 2, 3};
    cloud[5] = {-4, 5, 6};
    Scans scans;
    scans.push_back(test::world_scan(PositionEncoding::kFloat64, {}, {world_block(cloud)}));
    const ImportedPoints points = import_scans(scans, {}, context());
    EXPECT_EQ(points.grid.step[0], std::ldexp(1.0, -27));  // 6 / 2^30 < 2^-27
  }
}

TEST_F(ImportTest, AStrayPointBesideAPileOfEqualOnesDoesNotCrushTheOthers) {
  for (const std::size_t pile : {2000U, 300'001U}) {
    std::vector<std::array<double, 3>> cloud(pile, {0, 0, 0});
    cloud[1] = {1, 2, 3};
    cloud[5] = {-4, 5, 6};
    cloud[7] = {1e30, 1e30, 1e30};
    Scans scans;
    scans.push_back(test::world_scan(PositionEncoding::kFloat64, {}, {world_block(cloud)}));
    try {
      import_scans(scans, {}, context());
      FAIL() << "steps of 1e21 were accepted for points a few units apart";
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find("1e+30"), std::string::npos) << error.what();
    }
  }
}

TEST_F(ImportTest, TheScanThatLiesApartIsTheOneThatIsBlamed) {
  // Three scans of a few metres, the second in a frame of its own; scales that do not divide each other.
  Scans scans;
  scans.push_back(test::steps_scan({}, {steps_block({{0, 0, 0}, {900, 900, 900}})},
                                   {0.01, 0.01, 0.01}, {4.7e5, 3.8e6, 2000}));
  auto apart = test::steps_scan({}, {steps_block({{0, 0, 0}, {9000, 9000, 9000}})},
                                {0.00025, 0.00025, 0.00025});
  scans.push_back(std::move(apart));
  scans.push_back(test::steps_scan({}, {steps_block({{0, 0, 0}, {90000, 90000, 90000}})},
                                   {0.0001, 0.0001, 0.0001}, {4.7e5, 3.8e6, 2000}));
  try {
    import_scans(scans, {}, context());
    FAIL() << "an extent of 4000 km at 0.1 mm was accepted";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("points from (0, 0, 0) to (2.25, 2.25, 2.25)"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(ImportTest, AnOutlierOfAHundredKilometresIsNoReasonToRefuse) {
  std::vector<std::array<double, 3>> cloud;
  for (int i = 0; i < 1000; ++i) cloud.push_back({i * 1.0, 500.0 - i, 0});
  cloud.push_back({1e5, 0, 0});
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat64, {}, {world_block(cloud)}));
  EXPECT_EQ(import_scans(scans, {}, context()).points, 1001U);
}

TEST_F(ImportTest, OnePointAndIdenticalPointsHaveAGrid) {
  for (const double at : {0.0, 1e-9, 500000.123, 6378137.0}) {
    Scans scans;
    scans.push_back(test::world_scan(PositionEncoding::kFloat64, {},
                                     {world_block({{at, at, at}, {at, at, at}})}));
    const ImportedPoints points = import_scans(scans, {}, context());
    EXPECT_EQ(world_of(points)[0][0], at);
  }
}

TEST_F(ImportTest, MergesSchemasWideningColoursAndFillingZeros) {
  PointBlock narrow = steps_block({{0, 0, 0}});
  add_column<std::uint8_t>(narrow, {255, 1, 0});
  PointBlock wide = steps_block({{1, 1, 1}});
  add_column<std::uint16_t>(wide, {65535, 256, 0});
  add_column<std::uint16_t>(wide, {77});
  Scans scans;
  scans.push_back(test::steps_scan({{"color", ScalarType::kU8, 3, ReduceRule::kMean}}, {narrow}));
  scans.push_back(test::steps_scan({{"color", ScalarType::kU16, 3, ReduceRule::kMean},
                                    {"intensity", ScalarType::kU16, 1, ReduceRule::kMean}},
                                   {wide}));
  const ImportedPoints points = import_scans(scans, {}, context());
  ASSERT_EQ(points.schema.size(), 2U);
  EXPECT_EQ(points.schema[0].type, ScalarType::kU16);
  std::uint16_t values[8];
  std::memcpy(values, points.array.bytes().data() + 12, 8);
  std::memcpy(values + 4, points.array.bytes().data() + points.stride + 12, 8);
  EXPECT_EQ(std::vector<std::uint16_t>(values, values + 8),
            (std::vector<std::uint16_t>{65535, 257, 0, 0, 65535, 256, 0, 77}));
}

// A dark tile of 16-bit colours has values of 8 bits only; those beside it tell.
TEST_F(ImportTest, TextsAgreeOnTheWidthOfTheirColours) {
  const auto dark = folder().write("dark.csv", "x,y,z,r,g,b\n0,0,0,10,20,255\n");
  const auto bright = folder().write("bright.csv", "x,y,z,r,g,b\n1,1,1,40000,0,65535\n");
  const auto dark_color_beside = [&](std::unique_ptr<formats::ScanReader> other) {
    Scans scans = formats::open_scans(dark, {});
    scans.push_back(std::move(other));
    const ImportedPoints points = import_scans(scans, {}, context());
    std::vector<std::uint16_t> imported(3), streamed(3);
    std::memcpy(imported.data(), points.array.bytes().data() + 24, 6);
    stream_canonical_records(scans, points.schema, points.grid, context(),
                             [&](std::size_t, std::span<std::byte> records, std::size_t) {
                               if (formats::load_le<std::int32_t>(records.data()) == 0)
                                 std::memcpy(streamed.data(), records.data() + 12, 6);
                             });
    EXPECT_EQ(streamed, imported);
    return imported;
  };
  EXPECT_EQ(dark_color_beside(std::move(formats::open_scans(bright, {}).front())),
            (std::vector<std::uint16_t>{10, 20, 255}));
  // Another kind of scan says nothing about texts.
  PointBlock block = world_block({{1, 1, 1}});
  add_column<std::uint16_t>(block, {40000, 0, 65535});
  EXPECT_EQ(dark_color_beside(test::world_scan(PositionEncoding::kFloat64,
                                               {{"color", ScalarType::kU16, 3, ReduceRule::kMean}},
                                               {block})),
            (std::vector<std::uint16_t>{2570, 5140, 65535}));
}

TEST_F(ImportTest, RefusesScansWithTooManyAttributesTogether) {
  Schema one, other;
  PointBlock block = steps_block({{0, 0, 0}});
  for (int i = 0; i < 511; ++i) {
    one.push_back({"a" + std::to_string(i), ScalarType::kU8, 1, ReduceRule::kNone});
    other.push_back({"b" + std::to_string(i), ScalarType::kU8, 1, ReduceRule::kNone});
    add_column<std::uint8_t>(block, {1});
  }
  Scans scans;
  scans.push_back(test::steps_scan(one, {block}));
  scans.push_back(test::steps_scan(other, {block}));
  try {
    import_scans(scans, {}, context());
    ADD_FAILURE() << "not refused";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("1022"), std::string::npos) << error.what();
  }
  EXPECT_EQ(
      import_scans(scans, {.drop = {"a0", "b0"}, .keep = {}, .resolution = {}}, context()).points,
      2U);
}

TEST_F(ImportTest, RefusesToDropWhatIsNotThere) {
  Scans scans;
  scans.push_back(test::steps_scan({}, {steps_block({{0, 0, 0}})}));
  EXPECT_THROW(import_scans(scans, {.drop = {"colour"}, .keep = {}, .resolution = {}}, context()),
               formats::Error);
}

/// A scan of one point with one attribute, all zeros.
std::unique_ptr<formats::ScanReader> scan_with(formats::Attribute attribute) {
  PointBlock block = steps_block({{0, 0, 0}});
  block.columns.emplace_back(attribute.size_bytes());
  return test::steps_scan({std::move(attribute)}, {std::move(block)});
}

TEST_F(ImportTest, WhatIsLeftOutNeedNotAgree) {
  Scans scans;
  scans.push_back(scan_with({"label", ScalarType::kU8, 1, ReduceRule::kNone}));
  scans.push_back(scan_with({"label", ScalarType::kU8, 3, ReduceRule::kNone}));
  scans.push_back(scan_with({"tag", ScalarType::kU8, 1, ReduceRule::kNone}));
  EXPECT_THROW(import_scans(scans, {}, context()), formats::Error);
  // A name given twice is left out once.
  const ImportedPoints dropped =
      import_scans(scans, {.drop = {"label", "label"}, .keep = {}, .resolution = {}}, context());
  ASSERT_EQ(dropped.schema.size(), 1U);
  EXPECT_EQ(dropped.schema[0].name, "tag");
  EXPECT_EQ(
      import_scans(scans, {.drop = {}, .keep = {"tag"}, .resolution = {}}, context()).schema.size(),
      1U);
}

TEST_F(ImportTest, RadiiThatAreNoneAreZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  PointBlock block = steps_block({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}});
  add_column<float>(block, {0.5F, -1, nan, inf, -inf});
  const Schema schema{{"radius", ScalarType::kF32, 1, ReduceRule::kCoverRadius}};
  Scans scans;
  scans.push_back(test::steps_scan(schema, {block}));
  const ImportedPoints points = import_scans(scans, {}, context());
  std::vector<float> radii, streamed;
  for (std::size_t i = 0; i < 5; ++i)
    radii.push_back(formats::load_le<float>(points.array.bytes().data() + i * points.stride + 12));
  EXPECT_EQ(radii, (std::vector<float>{0.5F, 0, 0, 0, 0}));
  // What verify digests is what the build stores.
  stream_canonical_records(scans, schema, points.grid, context(),
                           [&](std::size_t, std::span<std::byte> records, std::size_t stride) {
                             for (std::size_t i = 0; i < records.size(); i += stride)
                               streamed.push_back(formats::load_le<float>(records.data() + i + 12));
                           });
  EXPECT_EQ(streamed, radii);
}

TEST_F(ImportTest, RefusesToStreamScansThatDoNotFitTheSchema) {
  const auto stream = [this](formats::Attribute scan, formats::Attribute dataset) {
    Scans scans;
    scans.push_back(scan_with(std::move(scan)));
    stream_canonical_records(scans, {std::move(dataset)}, {}, context(),
                             [](std::size_t, auto, std::size_t) {});
  };
  const formats::Attribute one{"label", ScalarType::kU16, 1, ReduceRule::kNone};
  formats::Attribute other = one;
  EXPECT_NO_THROW(stream(one, one));
  other.type = ScalarType::kU8;
  EXPECT_NO_THROW(stream(other, one));  // a narrower scan fits
  other = one;
  for (int wrong = 0; wrong < 3; ++wrong) {
    if (wrong == 0) other = {"label", ScalarType::kU16, 200, ReduceRule::kNone};
    if (wrong == 1) other = {"label", ScalarType::kF64, 1, ReduceRule::kNone};
    if (wrong == 2) other = {"label", ScalarType::kI16, 1, ReduceRule::kNone};
    try {
      stream(other, one);
      FAIL() << wrong << " was accepted";
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find("label"), std::string::npos) << error.what();
    }
  }
}

TEST_F(ImportTest, RefusesCoordinatesWhoseSquaresADoubleCannotHold) {
  const auto import = [&](std::vector<std::array<double, 3>> world) {
    Scans scans;
    scans.push_back(
        test::world_scan(PositionEncoding::kFloat64, {}, {world_block(std::move(world))}));
    return import_scans(scans, {}, context()).points;
  };
  for (const double far : {1e308, 5e199, 1e141})
    for (const double sign : {-1.0, 1.0}) {
      EXPECT_THROW(import({{sign * far, 0, 0}}), formats::Error) << far;
      EXPECT_THROW(import({{far, 0, 0}, {0, sign * far, 0}}), formats::Error) << far;
    }
  for (const double near : {5e-324, 1e-200, 1e-141})
    EXPECT_THROW(import({{0, 0, 0}, {0, near, 0}}), formats::Error) << near;
  for (const double fine : {0.0, 1e-100, 1.0, 1e100})
    EXPECT_EQ(import({{0, 0, 0}, {fine, fine, 0}}), 2U) << fine;
  EXPECT_EQ(import({{1e-200, 0, 0}, {1e-200, 0, 0}}), 2U);  // no extent, no distances
}

/// Counts how many of its stretches are read at a time, each with a third of the tests' memory.
class LargeScan final : public formats::ScanReader {
 public:
  explicit LargeScan(std::size_t stretches) : stretches_(stretches) {
    info_.claimed_points = info_.present_points = stretches;
  }
  std::size_t stretch_count() const override { return stretches_; }
  std::uint64_t stretch_capacity(std::size_t) const override { return 1; }
  std::uint64_t read_bytes() const override { return (std::uint64_t{1} << 30) / 3; }
  void read(std::size_t, const formats::BlockSink& sink) const override {
    most_ = std::max(most_.load(), ++reading_);
    sink(world_block({{1, 2, 3}}));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    --reading_;
  }
  int most_at_a_time() const { return most_; }

 private:
  std::size_t stretches_;
  mutable std::atomic<int> reading_ = 0, most_ = 0;
};

TEST_F(ImportTest, AsManyWorkersReadAsTheMemoryHasRoomFor) {
  auto scan = std::make_unique<LargeScan>(8);
  const LargeScan& large = *scan;
  Scans scans;
  scans.push_back(std::move(scan));
  context().threads = 4;
  const ImportedPoints points = import_scans(scans, {}, context());
  EXPECT_EQ(large.most_at_a_time(), 1);
  stream_canonical_records(scans, points.schema, points.grid, context(),
                           [](std::size_t, auto, std::size_t) {});
  EXPECT_EQ(large.most_at_a_time(), 1);
}

TEST_F(ImportTest, CanonicalRecordsAreTheMappedPoints) {
  PointBlock block = world_block({{1.5, 2.25, -3}, {0, 0, 0}});
  add_column<std::uint8_t>(block, {7, 8});
  Scans scans;
  scans.push_back(test::world_scan(PositionEncoding::kFloat64,
                                   {{"tag", ScalarType::kU8, 1, ReduceRule::kNone}}, {block}));
  const ImportedPoints points = import_scans(scans, {}, context());
  std::multiset<std::string> streamed, expected;
  stream_canonical_records(
      scans, points.schema, points.grid, context(),
      [&](std::size_t, std::span<std::byte> records, std::size_t stride) {
        for (std::size_t i = 0; i < records.size(); i += stride)
          streamed.insert(std::string(reinterpret_cast<const char*>(records.data()) + i, stride));
      });
  for (std::size_t i = 0; i < 2; ++i) {
    GridPoint p;
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] = static_cast<std::int32_t>(
          std::llround(block.world[i][axis] / points.grid.step[axis]) - points.grid.shift[axis]);
    std::string record(13, '\0');
    std::memcpy(record.data(), p.data(), 12);
    record[12] = static_cast<char>(7 + i);
    expected.insert(record);
  }
  EXPECT_EQ(streamed, expected);
}

}  // namespace
}  // namespace cairn::stages
