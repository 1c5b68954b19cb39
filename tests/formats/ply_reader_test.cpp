// PLY files written out in the tests; the expected values are those that stand in the text, or bytes worked
// out by hand from IEEE 754.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "formats/error.h"
#include "tests/support/las_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

std::string ascii(const std::string& elements, const std::string& data) {
  return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + data;
}

class PlyReader : public testing::Test {
 protected:
  test::ScanPoints read(const std::string& bytes, const ScanOptions& options = {}) {
    return test::read_points(folder_.write("scan.ply", bytes), options);
  }

  void expect_refused(const std::string& bytes, const std::string& words,
                      const ScanOptions& options = {}) {
    try {
      read(bytes, options);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  test::TemporaryFolder folder_;
};

TEST_F(PlyReader, AsciiFloatsAreRoundedOnceToFloat32) {
  const auto scan = read(ascii("element vertex 1\n" + kXyz, "0.1 16777217 -1e-45\n"));
  EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat32);
  EXPECT_EQ(scan.world(0)[0], 0x1.99999ap-4);  // the float32 nearest to 0.1
  EXPECT_EQ(scan.world(0)[1], 16777216.0);     // 2^24 + 1 lies between two float32
  EXPECT_EQ(scan.world(0)[2], -0x1p-149);      // the smallest float32
}

TEST_F(PlyReader, AsciiDoublesAndIntegersAreFloat64) {
  const auto scan =
      read(ascii("element vertex 1\nproperty double x\nproperty int y\nproperty float z\n",
                 "1234567890.12345 -2147483648 0.5\n"));
  EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(scan.world(0), (std::array<double, 3>{1234567890.12345, -2147483648.0, 0.5}));
}

TEST_F(PlyReader, AcceptsNonFiniteFloats) {
  const auto scan = read(ascii("element vertex 1\n" + kXyz, "nan -inf 1e60\n"));
  EXPECT_TRUE(std::isnan(scan.world(0)[0]));
  EXPECT_EQ(scan.world(0)[1], -std::numeric_limits<double>::infinity());
  EXPECT_EQ(scan.world(0)[2], std::numeric_limits<double>::infinity());
}

TEST_F(PlyReader, RefusesDamagedNumbersNamingLineAndProperty) {
  const std::string header = "element vertex 2\n" + kXyz + "property uchar level\n";
  const std::string begin = ascii(header, "0 0 0 0\n");
  for (const char* bad : {"256", "-1", "1.0", "1e1", "0x1", "a", "1,"}) {
    expect_refused(begin + "0 0 0 " + bad + "\n", "level");
    expect_refused(begin + "0 0 0 " + bad + "\n", "at byte " + std::to_string(begin.size()));
  }
  for (const char* bad : {"1,5", "--1", "+-1", "1.5f", "one"})
    expect_refused(begin + bad + " 0 0 0\n", "property x");
}

TEST_F(PlyReader, GivesKnownPropertiesTheirMeaning) {
  const auto scan = read(
      ascii("element vertex 1\nproperty uchar blue\nproperty float nz\nproperty float z\nproperty "
            "uchar red\n"
            "property float x\nproperty float nx\nproperty float ny\nproperty float y\nproperty "
            "uchar green\n"
            "property float radius\nproperty float scalar_Intensity\nproperty ushort PointSource\n"
            "property uchar classification\n",
            "3 0.6 30 1 10 0 0.8 20 2 0.5 0.75 65535 31\n"));
  EXPECT_EQ(scan.world(0), (std::array<double, 3>{10, 20, 30}));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(scan.value<std::uint8_t>("color", 0, i), i + 1);
  EXPECT_EQ(scan.value<float>("normal", 0, 1), 0.8f);
  EXPECT_EQ(scan.value<float>("normal", 0, 2), 0.6f);
  EXPECT_EQ(scan.value<float>("radius", 0), 0.5f);
  EXPECT_EQ(scan.value<float>("intensity", 0), 0.75f);
  EXPECT_EQ(scan.value<std::uint16_t>("point_source", 0), 65535);
  const auto rule = [&](const char* name) {
    return scan.info.schema[find_attribute(scan.info.schema, name).value()].rule;
  };
  EXPECT_EQ(rule("color"), ReduceRule::kMean);
  EXPECT_EQ(rule("normal"), ReduceRule::kNormal);
  EXPECT_EQ(rule("radius"), ReduceRule::kCoverRadius);
  EXPECT_EQ(rule("intensity"), ReduceRule::kMean);
  EXPECT_EQ(rule("classification"), ReduceRule::kMajority);
  EXPECT_EQ(rule("point_source"), ReduceRule::kNone);
}

TEST_F(PlyReader, KnowsColorsUnderTheirOtherNames) {
  for (const std::string prefix : {"diffuse_red diffuse_green diffuse_blue", "r g b"}) {
    std::string properties = "element vertex 1\n" + kXyz;
    std::size_t at = 0;
    for (int i = 0; i < 3; ++i) {
      const std::size_t end = std::min(prefix.find(' ', at), prefix.size());
      properties += "property ushort " + prefix.substr(at, end - at) + "\n";
      at = end + 1;
    }
    const auto scan = read(ascii(properties, "0 0 0 1000 2000 65535\n"));
    EXPECT_EQ(scan.value<std::uint16_t>("color", 0, 2), 65535);
  }
}

TEST_F(PlyReader, ColorsOfOtherTypesStayApart) {
  const auto scan =
      read(ascii("element vertex 1\n" + kXyz +
                     "property float red\nproperty float green\nproperty float blue\n",
                 "0 0 0 0.25 0.5 1\n"));
  EXPECT_EQ(scan.names(), (std::vector<std::string>{"red", "green", "blue"}));
  EXPECT_EQ(scan.value<float>("green", 0), 0.5f);
}

TEST_F(PlyReader, NamesWithAMeaningAreKeptForTheTypesThatHaveIt) {
  const auto scan =
      read(ascii("element vertex 1\n" + kXyz +
                     "property int classification\nproperty float color\nproperty float a_b\n"
                     "property float a__b\n",
                 "0 0 0 1 2 3 4\n"));
  EXPECT_EQ(scan.names(),
            (std::vector<std::string>{"classification_2", "color_2", "a_b", "a_b_2"}));
}

TEST_F(PlyReader, ManyPropertiesThatAreNamedAlikeGetNumbers) {
  std::string header = "element vertex 1\n" + kXyz, line = "1 2 3";
  for (int i = 0; i < 1000; ++i) {
    header += "property uchar a" + std::string(static_cast<std::size_t>(i) + 1, '_') + "\n";
    line += " " + std::to_string(i % 256);
  }
  const auto scan = read(ascii(header, line + "\n"));
  EXPECT_EQ(scan.value<std::uint8_t>("a", 0), 0);
  EXPECT_EQ(scan.value<std::uint8_t>("a_2", 0), 1);
  EXPECT_EQ(scan.value<std::uint8_t>("a_1000", 0), 999 % 256);
}

TEST_F(PlyReader, NumbersOfNamesNeverMeetOneInUse) {
  std::string header = "element vertex 1\n" + kXyz;
  for (const char* name : {"a", "a_999999999", "a!", "a?", "a_2", "a#", "a_5", "a$", "a%"})
    header += "property uchar " + std::string(name) + "\n";
  const auto scan = read(ascii(header, "1 2 3 10 11 12 13 14 15 16 17 18\n"));
  ASSERT_EQ(scan.info.schema.size(), 9u);
  std::set<std::string> names;
  for (const Attribute& attribute : scan.info.schema) names.insert(attribute.name);
  EXPECT_EQ(names.size(), 9u);
  EXPECT_EQ(scan.value<std::uint8_t>("a", 0), 10);
  EXPECT_EQ(scan.value<std::uint8_t>("a_999999999", 0), 11);
  EXPECT_EQ(scan.value<std::uint8_t>("a_2", 0), 12);
  EXPECT_EQ(scan.value<std::uint8_t>("a_3", 0), 13);
}

TEST_F(PlyReader, HoldsNoMoreAttributesThanADataset) {
  std::string header = "element vertex 0\n" + kXyz;
  for (int i = 0; i < 1020; ++i) header += "property uchar p" + std::to_string(i) + "\n";
  EXPECT_EQ(read(ascii(header, "")).info.schema.size(), 1020u);
  expect_refused(ascii(header + "property uchar last\n", ""), "too many properties");
}

TEST_F(PlyReader, RefusesFilesCutBehindTheVertices) {
  const std::string faces = "element face 3\nproperty uchar list_less\nproperty float area\n";
  const auto binary = [&](const std::string& count, const std::string& elements, std::size_t size) {
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + count + "\n" + kXyz +
           elements + "end_header\n" + std::string(size, '\0');
  };
  EXPECT_EQ(read(binary("2", faces, 24 + 15)).points.count, 2u);
  expect_refused(binary("2", faces, 24 + 14), "the file ends before its last face");
  EXPECT_EQ(read(binary("2", faces, 24 + 14), {.allow_truncated = true}).points.count, 2u);
  // A third vertex would be made of the faces' bytes.
  expect_refused(binary("3", faces, 24 + 15), "the file ends before its last face");
  // Lists take at least the bytes of their lengths.
  const std::string lists = "element face 5\nproperty list int int vertex_indices\n";
  EXPECT_EQ(read(binary("2", lists, 24 + 20)).points.count, 2u);
  expect_refused(binary("2", lists, 24 + 19), "the file ends before its last face");
  expect_refused(binary("2", "element face 18446744073709551615\nproperty int i\n", 40),
                 "the file ends before its last face");
  // A line of text has a digit and a blank or an end for each value.
  const auto text = [&](const std::string& data) {
    return ascii("element vertex 1\n" + kXyz + "element edge 2\nproperty int a\nproperty int b\n",
                 data);
  };
  EXPECT_EQ(read(text("1 2 3\n0 1\n1 0")).points.count, 1u);
  expect_refused(text("1 2 3\n0 1\n"), "the file ends before its last edge");
}

TEST_F(PlyReader, PassesOverListsAndOtherElements) {
  const std::string header =
      "comment before\nelement camera 2\nproperty float view\nelement face 2\n"
      "property list uchar int indices\nelement empty 7\nelement vertex 2\ncomment within\n"
      "property list uchar float weights\n" +
      kXyz + "property list int int tail\nobj_info anything\nelement edge 1\nproperty int a\n";
  const auto scan =
      read(ascii(header, "1\n2\n3 0 1 2\n\n0\n2 0.5 0.5 1 2 3 0\n  \n0 4 5 6 2 8 9\n17\nmore\n"));
  ASSERT_EQ(scan.points.count, 2u);
  EXPECT_EQ(scan.world(0), (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(scan.world(1), (std::array<double, 3>{4, 5, 6}));
}

TEST_F(PlyReader, PassesOverListsAndOtherElementsInBinary) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement face 2\nproperty list uchar int indices\n"
      "element camera 3\nproperty double view\nelement vertex 2\nproperty list ushort short "
      "weights\n" +
      kXyz + "end_header\n";
  test::put<std::uint8_t>(bytes, 2);
  for (int i = 0; i < 2; ++i) test::put<std::int32_t>(bytes, i);
  test::put<std::uint8_t>(bytes, 0);
  for (int i = 0; i < 3; ++i) test::put<double>(bytes, i);
  for (int point = 0; point < 2; ++point) {
    test::put<std::uint16_t>(bytes, static_cast<std::uint16_t>(point));
    for (int i = 0; i < point; ++i) test::put<std::int16_t>(bytes, -1);
    for (int axis = 0; axis < 3; ++axis)
      test::put<float>(bytes, static_cast<float>(10 * point + axis));
  }
  const auto scan = read(bytes);
  ASSERT_EQ(scan.points.count, 2u);
  EXPECT_EQ(scan.world(0), (std::array<double, 3>{0, 1, 2}));
  EXPECT_EQ(scan.world(1), (std::array<double, 3>{10, 11, 12}));
  for (std::size_t size = bytes.size() - 14; size < bytes.size(); ++size) {
    expect_refused(bytes.substr(0, size), "ends before its last vertex");
    EXPECT_EQ(read(bytes.substr(0, size), {.allow_truncated = true}).points.count, 1u);
  }
}

TEST_F(PlyReader, ReadsBothByteOrders) {
  // 1.5 is 3FC00000, -2.0 is C0000000 and 0.1 is 3DCCCCCD as float32.
  const std::string big("\x3f\xc0\0\0\xc0\0\0\0\x3d\xcc\xcc\xcd\x01\x02", 14);
  const std::string little("\0\0\xc0\x3f\0\0\0\xc0\xcd\xcc\xcc\x3d\x02\x01", 14);
  for (const bool swap : {false, true}) {
    const auto scan =
        read("ply\r\nformat binary_" + std::string(swap ? "big" : "little") +
             "_endian 1.0\r\nelement vertex 1\r\n" +
             "property float32 x\r\nproperty float y\r\nproperty float z\r\nproperty uint16 id\r\n"
             "end_header\r\n" +
             (swap ? big : little));
    EXPECT_EQ(scan.world(0), (std::array<double, 3>{1.5, -2.0, 0x1.99999ap-4}));
    EXPECT_EQ(scan.value<std::uint16_t>("id", 0), 258);
    EXPECT_EQ(scan.info.format, swap ? "PLY binary big-endian" : "PLY binary little-endian");
  }
}

TEST_F(PlyReader, ReadsLinesOfAnyEnding) {
  const auto scan = read(
      "ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\n"
      "property float z\r\nend_header\r\n1 2 3\r\n\t4  5\t6 ");
  ASSERT_EQ(scan.points.count, 2u);
  EXPECT_EQ(scan.world(1), (std::array<double, 3>{4, 5, 6}));
}

TEST_F(PlyReader, RefusesMissingLinesUnlessTruncationIsAllowed) {
  const std::string bytes = ascii("element vertex 3\n" + kXyz, "1 2 3\n4 5 6\n7 8 90000");
  EXPECT_EQ(read(bytes).points.count, 3u);
  const std::string cut = bytes.substr(0, bytes.size() - 8);
  expect_refused(cut, "expected 3 vertices");
  EXPECT_EQ(read(cut, {.allow_truncated = true}).points.count, 2u);
}

TEST_F(PlyReader, AnUnendedLineCountsOnlyAsTheLast) {
  // "7 8 9" may have been "7 8 90000": with more lines promised the file was cut.
  const std::string bytes = ascii("element vertex 4\n" + kXyz, "1 2 3\n4 5 6\n7 8 9");
  EXPECT_EQ(read(bytes, {.allow_truncated = true}).points.count, 2u);
}

TEST_F(PlyReader, RefusesTooManyValuesInALine) {
  expect_refused(ascii("element vertex 1\n" + kXyz, "1 2 3 4\n"), "too many values");
  expect_refused(ascii("element vertex 2\n" + kXyz, "1 2\n3\n4 5 6\n"), "too few values");
}

TEST_F(PlyReader, RefusesACountTheFileIsTooSmallForBeforeAllocating) {
  const std::string count = "18446744073709551615";
  expect_refused(ascii("element vertex " + count + "\n" + kXyz, "1 2 3\n"), "expected " + count);
  const std::string binary = "ply\nformat binary_big_endian 1.0\nelement vertex " + count + "\n" +
                             kXyz + "end_header\n" + std::string(25, '\0');
  expect_refused(binary, "found at most 2 vertices");
  EXPECT_EQ(read(binary, {.allow_truncated = true}).points.count, 2u);
}

TEST_F(PlyReader, RefusesListLengthsThatRunPastTheFile) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
      "property list int double l\n" +
      kXyz + "end_header\n";
  const std::size_t at = bytes.size();
  bytes += std::string(16, '\0');
  EXPECT_EQ(read(bytes).points.count, 1u);
  test::put_at<std::int32_t>(bytes, at, 2147483647);
  expect_refused(bytes, "ends before its last vertex");
  test::put_at<std::int32_t>(bytes, at, -1);
  expect_refused(bytes, "negative length");
}

TEST_F(PlyReader, RefusesDamagedHeaders) {
  const std::string vertex = "element vertex 1\n" + kXyz;
  const std::string data = "end_header\n1 2 3\n";
  expect_refused("ply\n" + vertex + data, "names no format");
  expect_refused("ply\nformat ascii 2.0\n" + vertex + data, "unknown PLY format");
  expect_refused("ply\nformat ascii 1.0\nformat ascii 1.0\n" + vertex + data, "unknown PLY format");
  expect_refused(ascii("property float x\n" + vertex, "1 2 3\n"), "before the first element");
  expect_refused(ascii(vertex + vertex, "1 2 3\n"), "element is described twice");
  expect_refused(ascii(vertex + "property float x\n", "1 2 3\n"), "property is described twice");
  expect_refused(ascii(vertex + "property quad w\n", "1 2 3\n"), "unknown PLY type");
  expect_refused(ascii(vertex + "property list float int w\n", "1 2 3\n"), "no whole number");
  expect_refused(ascii(vertex + "nonsense\n", "1 2 3\n"), "unknown word");
  for (const char* count : {"-1", "1.5", "18446744073709551616", "", "1 2"})
    expect_refused(ascii("element vertex " + std::string(count) + "\n" + kXyz, "1 2 3\n"),
                   "damaged element");
  expect_refused("ply\nformat ascii 1.0\n" + vertex, "has no end");
  expect_refused(ascii("element vertex 1\nproperty float x\nproperty float y\n", "1 2\n"),
                 "no position");
  expect_refused(
      ascii("element vertex 1\nproperty float x\nproperty float y\nproperty list int int z\n",
            "1 2 0\n"),
      "no position");
}

TEST_F(PlyReader, RefusesHeadersAndLinesWithoutBound) {
  std::string comments;
  while (comments.size() < (1 << 20)) comments += "comment and so on, and on, and on\n";
  expect_refused(ascii(comments + "element vertex 0\n" + kXyz, ""), "header is too long");
  expect_refused("ply\ncomment " + std::string(3 << 20, 'x'), "line is too long");
  std::string properties = "element vertex 0\n" + kXyz;
  for (int i = 0; i < 2000; ++i) properties += "property float p" + std::to_string(i) + "\n";
  expect_refused(ascii(properties, ""), "too many properties");
}

TEST_F(PlyReader, AnEmptyScanHasNoStretches) {
  const auto path = folder_.write("scan.ply", ascii("element vertex 0\n" + kXyz, ""));
  const auto reader = test::open_scan(path, {});
  EXPECT_EQ(reader->stretch_count(), 0u);
  EXPECT_EQ(reader->info().present_points, 0u);
}

TEST_F(PlyReader, SplitsLongBinaryScansIntoStretchesInFileOrder) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 300000\n" + kXyz + "end_header\n";
  for (int i = 0; i < 300000; ++i)
    for (int axis = 0; axis < 3; ++axis) test::put<float>(bytes, static_cast<float>(i));
  const auto scan = read(bytes);
  EXPECT_EQ(test::open_scan(folder_ / "scan.ply", {})->stretch_count(), 2u);
  ASSERT_EQ(scan.points.count, 300000u);
  for (std::size_t i = 0; i < scan.points.count; ++i)
    ASSERT_EQ(scan.world(i)[2], static_cast<double>(i));
}

}  // namespace
}  // namespace cairn::formats
