// Texts out: the lines as they must read, and values read back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/scan_writer.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

void write(const std::filesystem::path& path, const ScanInfo& info, const PointBlock& block) {
  const auto writer = create_scan_writer(path, info, block.count, true);
  writer->write(block);
  writer->finish();
}

class TextWriter : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  ScanInfo info_;
  PointBlock block_;
};

TEST_F(TextWriter, LinesAreAsDescribed) {
  info_.encoding = PositionEncoding::kSteps;
  info_.scale = {0.01, 0.001, std::ldexp(1, -10)};
  info_.offset = {600000, 0, 0};
  info_.crs = crs_records("EPSG:2994").value();
  block_.count = 2;
  block_.steps = {{3701232, -5, 3}, {0, 0, -1}};
  test::add_column<std::uint16_t>(info_, block_, "intensity", ScalarType::kU16, {65535, 0});
  test::add_column<std::uint8_t>(info_, block_, "color", ScalarType::kU8, {10, 20, 30, 0, 0, 255});
  test::add_column<float>(info_, block_, "normal", ScalarType::kF32, {0, 0.6f, -0.8f, 0, 0, 1});
  test::add_column<double>(info_, block_, "gps_time", ScalarType::kF64, {12345.000001, -1e-300});
  test::add_column<std::int8_t>(info_, block_, "pair", ScalarType::kI8, {-1, -2, 3, 4});
  test::add_column<std::uint64_t>(info_, block_, "weight", ScalarType::kU64, {UINT64_MAX, 1});
  const std::string names =
      "x y z intensity red green blue nx ny nz gps_time pair_0 pair_1 weight\n";
  const std::string rows =
      "637012.32 -0.005 0.0029296875 65535 10 20 30 0 0.6 -0.8 12345.000001 -1 -2 "
      "18446744073709551615\n"
      "600000.00 0.000 -0.0009765625 0 0 0 255 0 0 1 -1e-300 3 4 1\n";
  write(folder_ / "out.xyz", info_, block_);
  EXPECT_EQ(test::read_text(folder_ / "out.xyz"), "# crs EPSG:2994\n" + names + rows);
  EXPECT_EQ(test::read_points(folder_ / "out.xyz").info.crs, info_.crs);
  // CSV knows no comments.
  std::string csv = names + rows;
  std::ranges::replace(csv, ' ', ',');
  write(folder_ / "out.csv", info_, block_);
  EXPECT_EQ(test::read_text(folder_ / "out.csv"), csv);
}

TEST_F(TextWriter, EveryNumberReadsBackTheSame) {
  std::mt19937_64 random(3);
  constexpr std::size_t kCount = 5000;
  block_.count = kCount;
  std::vector<float> floats;
  std::vector<double> doubles;
  std::vector<std::int64_t> whole;
  const auto any_double = [&] {
    double value = 0;
    do {
      const std::uint64_t bits = random();
      std::memcpy(&value, &bits, sizeof value);
    } while (!std::isfinite(value));
    return value;
  };
  for (std::size_t i = 0; i < kCount; ++i) {
    block_.world.push_back({any_double(), any_double(), any_double()});
    floats.push_back(std::uniform_real_distribution<float>(-1e6f, 1e6f)(random));
    doubles.push_back(any_double());
    whole.push_back(static_cast<std::int64_t>(random()));
  }
  test::add_column(info_, block_, "error", ScalarType::kF32, floats);
  test::add_column(info_, block_, "gps_time", ScalarType::kF64, doubles);
  test::add_column(info_, block_, "id", ScalarType::kI64, whole);
  for (const char* name : {"out.txt", "out.CSV", "out.asc"}) {
    write(folder_ / name, info_, block_);
    const test::ScanPoints back = test::read_points(folder_ / name);
    ASSERT_EQ(back.points.count, kCount);
    const auto error = find_attribute(back.info.schema, "error");
    ASSERT_EQ(back.info.schema.at(error.value()).type, ScalarType::kF64);  // nine digits
    for (std::size_t i = 0; i < kCount; ++i) {
      ASSERT_EQ(back.world(i), block_.world[i]);
      ASSERT_EQ(static_cast<float>(back.value<double>("error", i)), floats[i]);
      ASSERT_EQ(back.value<double>("gps_time", i), doubles[i]);
      ASSERT_EQ(back.value<std::int64_t>("id", i), whole[i]);
    }
  }
}

TEST_F(TextWriter, TellsWhatIsNoNumberSoThatItReadsBack) {
  block_.count = 3;
  block_.world = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  const double none = std::numeric_limits<double>::quiet_NaN();
  test::add_column<double>(info_, block_, "error", ScalarType::kF64, {-none, INFINITY, -INFINITY});
  write(folder_ / "out.xyz", info_, block_);
  const test::ScanPoints back = test::read_points(folder_ / "out.xyz");
  const auto type = back.info.schema.at(0).type;
  const auto at = [&](std::size_t i) {
    return type == ScalarType::kF32 ? back.value<float>("error", i)
                                    : back.value<double>("error", i);
  };
  EXPECT_TRUE(std::isnan(at(0)));
  EXPECT_EQ(at(1), INFINITY);
  EXPECT_EQ(at(2), -INFINITY);
}

TEST_F(TextWriter, RefusesMoreColumnsThanTheReaderTakes) {
  for (int i = 0; i < 5; ++i)
    info_.schema.push_back({"a" + std::to_string(i), ScalarType::kU8, 255, ReduceRule::kNone});
  EXPECT_THROW(create_scan_writer(folder_ / "out.xyz", info_, 1), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(TextWriter, LeavesNothingBehindUnlessItIsFinished) {
  block_.count = 1;
  block_.world = {{1, 2, 3}};
  create_scan_writer(folder_ / "out.xyz", info_, 1)->write(block_);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace cairn::formats
