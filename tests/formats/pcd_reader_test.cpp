// PCD files, written by hand for each rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "formats/error.h"
#include "tests/support/las_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Position = std::array<double, 3>;

struct Header {
  std::string fields = "x y z";
  std::string size = "4 4 4";
  std::string type = "F F F";
  std::string count = "1 1 1";
  std::string width = "2";
  std::string height = "1";
  std::string viewpoint = "0 0 0 1 0 0 0";
  std::string points = "2";
  std::string data = "ascii";

  std::string text() const {
    return "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS " + fields + "\nSIZE " +
           size + "\nTYPE " + type + "\nCOUNT " + count + "\nWIDTH " + width + "\nHEIGHT " +
           height + "\nVIEWPOINT " + viewpoint + "\nPOINTS " + points + "\nDATA " + data + "\n";
  }
};

/// LZF data that stands for `bytes`, in literal runs alone: a byte n - 1, then n bytes.
std::string literal_lzf(const std::string& bytes) {
  std::string packed;
  for (std::size_t at = 0; at < bytes.size(); at += 32) {
    const std::string run = bytes.substr(at, 32);
    packed += static_cast<char>(run.size() - 1);
    packed += run;
  }
  return packed;
}

std::string with_sizes(const std::string& packed, std::size_t unpacked) {
  std::string bytes;
  test::put(bytes, static_cast<std::uint32_t>(packed.size()));
  test::put(bytes, static_cast<std::uint32_t>(unpacked));
  return bytes + packed;
}

template <typename T>
std::string bytes_of(std::initializer_list<T> values) {
  std::string bytes;
  for (const T value : values) test::put(bytes, value);
  return bytes;
}

class PcdReader : public ::testing::Test {
 protected:
  test::ScanPoints read(const std::string& bytes, const ScanOptions& options = {}) {
    return test::read_points(folder_.write("scan.pcd", bytes), options);
  }

  std::string refusal(const std::string& bytes, const ScanOptions& options = {}) {
    try {
      read(bytes, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_THAT(error.what(), HasSubstr("scan.pcd"));
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  test::TemporaryFolder folder_;
};

TEST_F(PcdReader, ReadsAsciiWithAnySeparator) {
  for (const char* rows : {"1 2 3\n4 5 nan\n", "1,2,3\r\n4,5,nan", "1\t2\t3\n\n4\t5\tnan\n"}) {
    const auto scan = read(Header{}.text() + rows);
    ASSERT_EQ(scan.points.count, 2U);
    EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat32);
    EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
    EXPECT_TRUE(std::isnan(scan.world(1)[2]));
  }
}

// The numbers of 1.1 as float32 and float64 differ.
TEST_F(PcdReader, PositionsAreFloat64WhereAnAxisIs) {
  Header header{.size = "4 8 4"};
  const auto scan = read(header.text() + "1 1.1 3\n4 5 6\n");
  EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(scan.world(0)[1], 1.1);
}

TEST_F(PcdReader, FieldsBecomeAttributes) {
  const Header header{.fields = "X Y Z rgb normal_x normal_y normal_z _ intensity descriptor ring",
                      .size = "4 4 4 4 4 4 4 1 4 2 1",
                      .type = "F F F F F F F U F I U",
                      .count = "1 1 1 1 1 1 1 3 1 2 1",
                      .width = "1",
                      .points = "1",
                      .data = "binary"};
  const std::string row = bytes_of({1.F, 2.F, 3.F}) + bytes_of<std::uint32_t>({0xff0a141e}) +
                          bytes_of({0.F, 0.6F, 0.8F}) + "pad" + bytes_of({7.5F}) +
                          bytes_of<std::int16_t>({-1, 300}) + "\x05";
  const auto scan = read(header.text() + row);
  EXPECT_THAT(scan.names(), ElementsAre("normal", "color", "intensity", "descriptor", "ring"));
  EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 0), 10);
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 1), 20);
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 2), 30);
  EXPECT_EQ(scan.value<float>("normal", 0, 2), 0.8F);
  EXPECT_EQ(scan.value<float>("intensity", 0), 7.5F);
  EXPECT_EQ(scan.value<std::int16_t>("descriptor", 0, 1), 300);
  EXPECT_EQ(scan.value<std::uint8_t>("ring", 0), 5);
}

TEST_F(PcdReader, PackedColorsAreTheSameAsFloatOrInteger) {
  Header header{.fields = "x y z rgba", .size = "4 4 4 4", .type = "F F F U", .count = "1 1 1 1"};
  const auto whole = read(header.text() + "1 2 3 1678382110\n4 5 6 0\n");  // 0x640a141e
  EXPECT_THAT(whole.names(), ElementsAre("color", "alpha"));
  EXPECT_EQ(whole.value<std::uint8_t>("color", 0, 1), 20);
  EXPECT_EQ(whole.value<std::uint8_t>("alpha", 0), 100);
  header.fields = "x y z rgb";
  header.type = "F F F F";
  const auto real = read(header.text() + "1 2 3 9.2212e-40\n4 5 6 0\n");  // 658046 = 0x0a0a7e
  EXPECT_THAT(real.names(), ElementsAre("color"));
  EXPECT_EQ(real.value<std::uint8_t>("color", 0, 0), 10);
}

TEST_F(PcdReader, TheViewpointTellsTheSensorAndMovesNothing) {
  EXPECT_FALSE(read(Header{}.text() + "1 2 3\n4 5 6\n").info.sensor);
  const auto scan = read(Header{.viewpoint = "7 8 9 0 1 0 0"}.text() + "1 2 3\n4 5 6\n");
  EXPECT_EQ(scan.info.sensor, (Vector3{7, 8, 9}));
  EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
}

TEST_F(PcdReader, ReadsCompressedFieldsAndPadding) {
  Header header{.fields = "x _ y z n",
                .size = "4 1 4 4 2",
                .type = "F U F F U",
                .count = "1 4 1 1 1",
                .data = "binary_compressed"};
  const std::string columns =
      bytes_of({1.F, 4.F, 2.F, 5.F, 3.F, 6.F}) + bytes_of<std::uint16_t>({700, 800});
  const auto scan = read(header.text() + with_sizes(literal_lzf(columns), columns.size()));
  ASSERT_EQ(scan.points.count, 2U);
  EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
  EXPECT_EQ(scan.world(1), (Position{4, 5, 6}));
  EXPECT_EQ(scan.value<std::uint16_t>("n", 1), 800);
}

// A zero and a reference of the greatest length: 1 + 264 bytes, of five that are stored.
TEST_F(PcdReader, AReferenceExpandsByNoMoreThanTheBound) {
  const Header header{.width = "22", .points = "22", .data = "binary_compressed"};
  std::string packed("\0\0", 2);
  packed += std::string("\xe0\xfe\x00", 3);  // one byte back, 254 + 9 = 263 long
  const auto scan = read(header.text() + with_sizes(packed, 264));
  ASSERT_EQ(scan.points.count, 22U);
  EXPECT_EQ(scan.world(21), (Position{0, 0, 0}));
}

TEST_F(PcdReader, RefusesSizesThatCannotBe) {
  Header header{.data = "binary_compressed"};
  const std::string packed = literal_lzf(std::string(24, 'a'));
  EXPECT_THAT(refusal(header.text() + with_sizes(packed, 25)), HasSubstr("wrong size"));
  EXPECT_THAT(refusal(header.text() + with_sizes(packed, 24).substr(0, 30)),
              HasSubstr("ends before its last point"));
  EXPECT_THAT(refusal(header.text() + with_sizes(std::string(25, '\xff'), 24)),
              HasSubstr("damaged compressed points"));
  EXPECT_THAT(refusal(header.text() + with_sizes("", 24)), HasSubstr("that they cannot have"));
  header.points = header.width = "300000000";
  EXPECT_THAT(refusal(header.text() + with_sizes(packed, 3600000000U)),
              HasSubstr("claim a size that they cannot have"));
}

TEST_F(PcdReader, RefusesMoreBinaryPointsThanItsHeaderTells) {
  const Header header{.data = "binary"};
  const std::string rows = bytes_of({1.F, 2.F, 3.F, 4.F, 5.F, 6.F});
  EXPECT_THAT(refusal(header.text() + rows + rows.substr(0, 12)),
              HasSubstr("found room for 3, expected 2"));
  EXPECT_THAT(refusal(header.text() + rows + std::string(4096, '\0')),
              HasSubstr("found room for 343, expected 2"));
  // Less than a page of zeros is what writers leave, less than a point can be none.
  EXPECT_EQ(read(header.text() + rows + std::string(4095, '\0')).points.count, 2U);
  EXPECT_EQ(read(header.text() + rows + rows.substr(0, 11)).points.count, 2U);
}

TEST_F(PcdReader, PointsRuleOverAMissingSize) {
  const std::string rows = "1 2 3\n4 5 6\n";
  EXPECT_EQ(read(Header{.width = "0", .height = "0"}.text() + rows).points.count, 2U);
  EXPECT_EQ(read(Header{.width = "1", .height = "2"}.text() + rows).points.count, 2U);
  EXPECT_THAT(refusal(Header{.width = "3"}.text() + rows), HasSubstr("contradictory"));
  EXPECT_THAT(refusal(Header{.width = "4294967296", .height = "4294967296"}.text() + rows),
              HasSubstr("contradictory"));
  // Rows beyond the claim are kept, as in every text.
  const auto more = read(Header{}.text() + rows + "7 8 9\n");
  EXPECT_EQ(more.points.count, 3U);
  EXPECT_EQ(more.info.claimed_points, 3U);
}

TEST_F(PcdReader, RefusesDamagedHeaders) {
  const std::string rows = "1 2 3\n4 5 6\n";
  EXPECT_THAT(refusal(rows), HasSubstr("unknown word"));
  EXPECT_THAT(refusal("VERSION .7\nDATA ascii\n" + rows), HasSubstr("expected a line FIELDS"));
  EXPECT_THAT(refusal(Header{.data = "ascii1 2 3"}.text() + rows), HasSubstr("unknown encoding"));
  EXPECT_THAT(refusal(Header{.fields = "x y w"}.text() + rows), HasSubstr("no position"));
  EXPECT_THAT(refusal(Header{.size = "4 4"}.text() + rows), HasSubstr("not a size for each"));
  EXPECT_THAT(refusal(Header{.size = "4 4 3"}.text() + rows), HasSubstr("unknown type"));
  EXPECT_THAT(refusal(Header{.count = "1 1 0"}.text() + rows), HasSubstr("unusable count"));
  EXPECT_THAT(refusal(Header{.count = "1 1 2000000"}.text() + rows), HasSubstr("unusable count"));
  EXPECT_THAT(refusal(Header{.viewpoint = "0 0 0"}.text() + rows), HasSubstr("VIEWPOINT"));
  EXPECT_THAT(refusal(Header{.points = "two"}.text() + rows), HasSubstr("damaged number"));
  EXPECT_THAT(refusal("VERSION 0.8\n" + Header{}.text().substr(53) + rows), HasSubstr("0.7"));
}

TEST_F(PcdReader, RefusesDamagedRows) {
  EXPECT_THAT(refusal(Header{}.text() + "1 2 3\n4 5\n"), HasSubstr("line 13: too few values"));
  EXPECT_THAT(refusal(Header{}.text() + "1 2 3\n4 5 6 7\n"), HasSubstr("line 13: too many values"));
  EXPECT_THAT(refusal(Header{}.text() + "1 2 3\n4 b 6\n"),
              HasSubstr("damaged value of the field y"));
  EXPECT_THAT(refusal(Header{}.text() + "1 2 3\n"), HasSubstr("found 1 points, expected 2"));
  EXPECT_EQ(read(Header{}.text() + "1 2 3\n4 5", {.allow_truncated = true}).points.count, 1U);
}

TEST_F(PcdReader, BinaryStretchesFollowEachOther) {
  constexpr std::size_t kPoints = 262144 + 77;
  Header header{
      .width = std::to_string(kPoints), .points = std::to_string(kPoints), .data = "binary"};
  std::string bytes = header.text();
  for (std::size_t i = 0; i < kPoints; ++i)
    bytes += bytes_of({static_cast<float>(i), 1.F, static_cast<float>(i % 7)});
  const auto reader = test::open_scan(folder_.write("long.pcd", bytes));
  ASSERT_EQ(reader->stretch_count(), 2U);
  const auto scan = test::read_points(*reader);
  ASSERT_EQ(scan.points.count, kPoints);
  for (std::size_t i = 0; i < kPoints; ++i)
    ASSERT_EQ(scan.world(i), (Position{static_cast<double>(i), 1, static_cast<double>(i % 7)}));
}

}  // namespace
}  // namespace cairn::formats
