// LAS out: read back as the same multiset of points, and held against the specification byte by byte.
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "formats/error.h"
#include "formats/scans/scan_writer.h"
#include "tests/support/las_bytes.h"
#include "tests/support/manifest.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::get_at;

const std::filesystem::path kShared = CAIRN_SHARED_DATA;

/// A scan of two points made in the test.
struct MadeScan {
  ScanInfo info;
  PointBlock block;

  MadeScan() {
    info.encoding = PositionEncoding::kSteps;
    info.scale = {0.5, 0.25, 0.125};
    info.offset = {100, -200, 0};
    block.count = 2;
    block.steps = {{1, 2, 3}, {-7, 8, 2147483647}};
  }

  template <typename T>
  void add(std::string name, ScalarType type, const std::vector<T>& values) {
    info.schema.push_back({std::move(name), type, static_cast<std::uint8_t>(values.size() / 2)});
    const auto bytes = std::as_bytes(std::span(values));
    block.columns.emplace_back(bytes.begin(), bytes.end());
  }
};

class LasWriter : public testing::Test {
 protected:
  std::string written(const MadeScan& scan, std::uint64_t expected_points = 2) {
    const auto writer = create_scan_writer(folder_ / "out.las", scan.info, expected_points, true);
    writer->write(scan.block);
    writer->finish();
    return test::read_text(folder_ / "out.las");
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_.path()),
                      std::filesystem::directory_iterator{}));
  }

  test::TemporaryFolder folder_;
};

TEST_F(LasWriter, EveryRealScanComesBackAsTheSamePoints) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = test::read_manifest(kShared / "MANIFEST.tsv");
  for (const auto& entry : entries) {
    if (!entry.path.ends_with(".las") || entry.is_hostile()) continue;
    SCOPED_TRACE(entry.path);
    const auto out = folder_ / "out.las";
    test::copy_scan(kShared / entry.path, out);
    const auto before = test::read_points(kShared / entry.path);
    const auto after = test::read_points(out);
    EXPECT_EQ(after.info.scale, before.info.scale);
    EXPECT_EQ(after.info.offset, before.info.offset);
    EXPECT_EQ(after.info.crs, before.info.crs);
    EXPECT_EQ(after.info.schema, before.info.schema);
    EXPECT_TRUE(after.records(before.names()) == before.records(before.names()));
  }
}

TEST_F(LasWriter, HeaderOfLas12IsWhatTheSpecificationSays) {
  MadeScan scan;
  scan.add<std::uint16_t>("color", ScalarType::kU16, {1, 2, 3, 65535, 5, 6});
  scan.add<std::uint8_t>("return_number", ScalarType::kU8, {1, 3});
  const std::string bytes = written(scan);
  EXPECT_EQ(bytes.substr(0, 4), "LASF");
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 24), 1);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 25), 2);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 94), 227);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 96), 227u);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 100), 0u);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 104), 2);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 105), 26);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 107), 2u);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 111), 1u);  // first returns
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 119), 1u);  // third returns
  EXPECT_EQ(get_at<double>(bytes, 131), 0.5);
  EXPECT_EQ(get_at<double>(bytes, 155), 100.0);
  EXPECT_EQ(get_at<double>(bytes, 179), 100.5);  // greatest x
  EXPECT_EQ(get_at<double>(bytes, 187), 96.5);   // least x
  EXPECT_EQ(get_at<double>(bytes, 195), -198.0);
  ASSERT_EQ(bytes.size(), 227u + 2 * 26);
  EXPECT_EQ(get_at<std::int32_t>(bytes, 227 + 26), -7);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 227 + 26 + 14), 3);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 227 + 26 + 20), 65535);
}

TEST_F(LasWriter, PointsWithoutReturnsAreSingleReturns) {
  const MadeScan scan;
  const std::string bytes = written(scan);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 227 + 14), 0b00001001);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 111), 2u);
}

TEST_F(LasWriter, EightBitColorsAreWrittenTimes257) {
  MadeScan scan;
  scan.add<std::uint8_t>("color", ScalarType::kU8, {0, 1, 255, 128, 2, 3});
  const std::string bytes = written(scan);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 227 + 22), 257);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 227 + 24), 65535);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 227 + 26 + 20), 32896);
}

TEST_F(LasWriter, WhatLasHasNoFieldForBecomesTypedExtraBytes) {
  MadeScan scan;
  scan.add<float>("normal", ScalarType::kF32, {0, 0, 1, 0.6f, 0, 0.8f});
  scan.info.schema.back().rule = ReduceRule::kNormal;
  scan.add<double>("height_above_ground", ScalarType::kF64, {1.5, -2.5});
  scan.add<std::int16_t>("pair", ScalarType::kI16, {1, -2, 3, -4});
  scan.add<std::uint8_t>("blob", ScalarType::kU8, std::vector<std::uint8_t>(18, 7));
  scan.add<std::uint64_t>("time_ns", ScalarType::kU64, {1, 18446744073709551615u});
  const std::string bytes = written(scan);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 25), 4);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 105), 20 + 12 + 8 + 4 + 9 + 8);
  // One VLR with seven entries: three for the normal.
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 100), 1u);
  EXPECT_EQ(bytes.substr(375 + 2, 9), "LASF_Spec");
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 375 + 18), 4);
  ASSERT_EQ(get_at<std::uint16_t>(bytes, 375 + 20), 7 * 192);
  const std::size_t entries = 375 + 54;
  const std::vector<int> types{9, 9, 9, 10, 14, 0, 7};
  for (std::size_t i = 0; i < types.size(); ++i)
    EXPECT_EQ(get_at<std::uint8_t>(bytes, entries + 192 * i + 2), types[i]) << i;
  EXPECT_EQ(get_at<std::uint8_t>(bytes, entries + 192 * 5 + 3), 9);  // nine bytes
  EXPECT_EQ(std::string(bytes.c_str() + entries + 4), "NormalX");
  EXPECT_EQ(std::string(bytes.c_str() + entries + 192 * 3 + 4), "height_above_ground");
  const auto read = test::read_points(folder_ / "out.las");
  EXPECT_EQ(read.value<float>("normal", 1, 2), 0.8f);
  EXPECT_EQ(read.value<double>("height_above_ground", 1), -2.5);
  EXPECT_EQ(read.value<std::int16_t>("pair", 1, 1), -4);
  EXPECT_EQ(read.value<std::uint8_t>("blob", 1, 8), 7);
  EXPECT_EQ(read.value<std::uint64_t>("time_ns", 1), 18446744073709551615u);
}

TEST_F(LasWriter, ChoosesTheSmallestPointFormatThatHoldsTheAttributes) {
  struct Case {
    std::vector<std::string> names;
    int format;
    int minor;
  };
  const std::vector<Case> cases{
      {{}, 0, 2},
      {{"gps_time"}, 1, 2},
      {{"color"}, 2, 2},
      {{"gps_time", "color"}, 3, 2},
      {{"waveform"}, 4, 4},
      {{"waveform", "color"}, 5, 4},
      {{"scan_angle"}, 6, 4},
      {{"scan_angle", "color"}, 7, 4},
      {{"near_infrared"}, 8, 4},
      {{"scan_angle", "waveform"}, 9, 4},
      {{"near_infrared", "waveform"}, 10, 4},
  };
  for (const Case& c : cases) {
    MadeScan scan;
    for (const std::string& name : c.names) {
      if (name == "gps_time") scan.add<double>(name, ScalarType::kF64, {1, 2});
      if (name == "color") scan.add<std::uint16_t>(name, ScalarType::kU16, {1, 2, 3, 4, 5, 6});
      if (name == "waveform")
        scan.add<std::uint8_t>(name, ScalarType::kU8, std::vector<std::uint8_t>(58, 9));
      if (name == "scan_angle") scan.add<std::int16_t>(name, ScalarType::kI16, {-5, 6});
      if (name == "near_infrared") scan.add<std::uint16_t>(name, ScalarType::kU16, {7, 8});
    }
    const std::string bytes = written(scan);
    EXPECT_EQ(get_at<std::uint8_t>(bytes, 104), c.format);
    EXPECT_EQ(get_at<std::uint8_t>(bytes, 25), c.minor);
    // LAS 1.4: the legacy count is 0 for formats 6 and up, else the same.
    EXPECT_EQ(get_at<std::uint32_t>(bytes, 107), c.format >= 6 ? 0u : 2u);
    if (c.minor == 4) {
      EXPECT_EQ(get_at<std::uint64_t>(bytes, 247), 2u);
    }
  }
}

TEST_F(LasWriter, AValueThatNeedsMoreBitsConvertsWhatWasWritten) {
  MadeScan scan;
  scan.add<std::uint8_t>("classification", ScalarType::kU8, {2, 31});
  scan.add<std::uint8_t>("return_number", ScalarType::kU8, {1, 7});
  scan.add<std::int8_t>("scan_angle_rank", ScalarType::kI8, {-90, 90});
  scan.add<std::uint8_t>("color", ScalarType::kU8, {1, 2, 3, 4, 5, 6});
  MadeScan late = scan;
  late.block.columns[0] = {std::byte{32}, std::byte{255}};
  late.block.columns[1] = {std::byte{15}, std::byte{0}};
  const auto writer = create_scan_writer(folder_ / "out.las", scan.info, 4);
  writer->write(scan.block);
  writer->write(late.block);
  writer->finish();
  EXPECT_EQ(files(), 1u);
  const auto read = test::read_points(folder_ / "out.las");
  EXPECT_EQ(read.info.format, "LAS 1.4, point format 7");
  ASSERT_EQ(read.points.count, 4u);
  const std::vector<int> classes{2, 31, 32, 255}, returns{1, 7, 15, 0}, angles{-90, 90, -90, 90};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read.value<std::uint8_t>("classification", i), classes[i]);
    EXPECT_EQ(read.value<std::uint8_t>("return_number", i), returns[i]);
    EXPECT_EQ(read.value<std::int8_t>("scan_angle_rank", i), angles[i]);
    EXPECT_EQ(read.value<std::uint16_t>("color", i, 1), 257 * (i % 2 == 0 ? 2 : 5));
    EXPECT_EQ(read.points.steps[i], scan.block.steps[i % 2]);
  }
}

TEST_F(LasWriter, AValueThatNoFormatHoldsIsRefusedAndNothingIsLeft) {
  MadeScan scan;
  scan.add<std::uint8_t>("return_number", ScalarType::kU8, {1, 16});
  EXPECT_THROW(written(scan), Error);
  EXPECT_EQ(files(), 0u);
}

TEST_F(LasWriter, WktIsAnnouncedInTheGlobalEncoding) {
  MadeScan scan;
  scan.info.crs = {{"LASF_Projection", 2112, "WKT", std::vector<std::byte>(100, std::byte{'x'})}};
  const std::string bytes = written(scan);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 25), 4);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 6), 16);
  EXPECT_EQ(test::read_points(folder_ / "out.las").info.crs, scan.info.crs);
}

TEST_F(LasWriter, PointFormatsFromSixOnAlwaysSetTheWktBit) {
  // LAS 1.4 R15, "Global Encoding": bit 4 must be set for point formats 6 to 10.
  MadeScan scan;
  scan.add<std::int16_t>("scan_angle", ScalarType::kI16, {100, -100});
  std::string bytes = written(scan);
  ASSERT_EQ(get_at<std::uint8_t>(bytes, 104), 6);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 6), 16);
  scan.info.crs = {{"LASF_Projection", 34735, "keys", std::vector<std::byte>(8, std::byte{1})}};
  bytes = written(scan);
  EXPECT_EQ(get_at<std::uint16_t>(bytes, 6), 16);
  EXPECT_EQ(test::read_points(folder_ / "out.las").info.crs, scan.info.crs);
  MadeScan narrow;
  narrow.info.crs = scan.info.crs;
  EXPECT_EQ(get_at<std::uint16_t>(written(narrow), 6), 0);
}

TEST_F(LasWriter, LongCoordinateSystemsGoBehindThePoints) {
  MadeScan scan;
  scan.info.crs = {{"LASF_Projection", 34735, "keys", std::vector<std::byte>(8, std::byte{1})},
                   {"LASF_Projection", 2112, "WKT", std::vector<std::byte>(70000, std::byte{'x'})}};
  const std::string bytes = written(scan);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 243), 1u);
  EXPECT_EQ(get_at<std::uint64_t>(bytes, 235), bytes.size() - 70060);
  EXPECT_EQ(test::read_points(folder_ / "out.las").info.crs, scan.info.crs);
}

TEST_F(LasWriter, MoreThan32BitsOfPointsAreLas14) {
  const std::string bytes = written(MadeScan(), 1ull << 32);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 25), 4);
  EXPECT_EQ(get_at<std::uint8_t>(bytes, 104), 0);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 107), 2u);
}

TEST_F(LasWriter, AnEmptyScanIsAValidFile) {
  const auto writer = create_scan_writer(folder_ / "out.las", MadeScan().info, 0);
  writer->finish();
  EXPECT_EQ(test::read_points(folder_ / "out.las").points.count, 0u);
}

TEST_F(LasWriter, NothingAppearsBeforeItIsFinished) {
  folder_.write("out.las", std::string_view("what was there"));
  {
    const auto writer = create_scan_writer(folder_ / "out.las", MadeScan().info, 2);
    writer->write(MadeScan().block);
    EXPECT_EQ(files(), 2u);
  }
  EXPECT_EQ(files(), 1u);
  EXPECT_EQ(test::read_text(folder_ / "out.las"), "what was there");
}

TEST_F(LasWriter, NeedsAGridAndAKnownSuffix) {
  ScanInfo info = MadeScan().info;
  EXPECT_THROW(create_scan_writer(folder_ / "out.e57", info, 2), Error);
  info.encoding = PositionEncoding::kFloat64;
  EXPECT_THROW(create_scan_writer(folder_ / "out.las", info, 2), Error);
  EXPECT_EQ(files(), 0u);
}

/// Lets no file of this process grow beyond a size while it lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t size_bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{size_bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST_F(LasWriter, AFailedWriteIsASystemErrorThatNamesTheFileAndLeavesNothing) {
  for (const char* name : {"out.las", "out.ply"}) {
    try {
      const FileSizeLimit limit(1000);
      const auto writer = create_scan_writer(folder_ / name, MadeScan().info, 1000000);
      for (int i = 0; i < 100; ++i) writer->write(MadeScan().block);
      writer->finish();
      ADD_FAILURE() << "the limit does not work";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kSystem);
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
    EXPECT_EQ(files(), 0u);
  }
}

TEST_F(LasWriter, AMissingFolderIsASystemError) {
  EXPECT_THROW(create_scan_writer(folder_ / "nowhere/out.las", MadeScan().info, 1), Error);
}

}  // namespace
}  // namespace cairn::formats
