// E57 files, built for each rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include "formats/error.h"
#include "tests/support/e57_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Position = std::array<double, 3>;
using test::E57Bytes;
using test::E57ScanBytes;
using test::E57Stream;
using Values = std::vector<std::int64_t>;

class E57Reader : public ::testing::Test {
 protected:
  std::vector<test::ScanPoints> read_all(const E57Bytes& file, const ScanOptions& options = {}) {
    std::vector<test::ScanPoints> scans;
    for (const auto& reader : open_scans(folder_.write("scan.e57", file.bytes()), options))
      scans.push_back(test::read_points(*reader));
    return scans;
  }

  test::ScanPoints read(const E57ScanBytes& scan, const ScanOptions& options = {}) {
    return read_all({.scans = {scan}}, options).at(0);
  }

  /// Three points on a line, and one more stream.
  test::ScanPoints read_with(const E57Stream& stream, const std::string& xml = "") {
    E57ScanBytes scan{.streams = test::e57_line(3), .xml = xml};
    scan.streams.push_back(stream);
    return read(scan);
  }

  test::TemporaryFolder folder_;
};

const std::string kEighthTurnAndMove =
    "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">0.5</w>"
    "<x type=\"Float\"/><y type=\"Float\"/><z type=\"Float\">0.5</z></rotation>"
    "<translation type=\"Structure\"><x type=\"Float\">10</x><y type=\"Float\">20</y>"
    "<z type=\"Float\">30</z></translation></pose>";

std::string color_limits(const std::string& type, const std::string& most) {
  std::string xml = "<colorLimits type=\"Structure\">";
  for (const char* name : {"Red", "Green", "Blue"})
    xml += std::string("<color") + name + "Minimum type=\"" + type + "\"/><color" + name +
           "Maximum type=\"" + type + "\">" + most + "</color" + name + "Maximum>";
  return xml + "</colorLimits>";
}

std::vector<E57Stream> line_with_colors(std::int64_t least, std::int64_t most, const Values& red,
                                        const Values& green, const Values& blue) {
  std::vector<E57Stream> streams = test::e57_line(red.size());
  streams.push_back(test::e57_integers("colorRed", least, most, red));
  streams.push_back(test::e57_integers("colorGreen", least, most, green));
  streams.push_back(test::e57_integers("colorBlue", least, most, blue));
  return streams;
}

TEST_F(E57Reader, FloatsAreReadAsTheyAre) {
  const auto wide = read({.streams = test::e57_line(5)});
  EXPECT_EQ(wide.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(wide.info.format, "E57 1.0");
  EXPECT_EQ(wide.info.part, "");
  EXPECT_FALSE(wide.info.sensor);
  ASSERT_EQ(wide.points.count, 5U);
  EXPECT_EQ(wide.world(4), (Position{4, 8, 12}));
  const auto narrow = read(
      {.streams = {test::e57_floats("cartesianX", {0.1F}), test::e57_floats("cartesianY", {-3e38F}),
                   test::e57_floats("cartesianZ", {1e-40F})}});
  EXPECT_EQ(narrow.info.encoding, PositionEncoding::kFloat32);
  EXPECT_EQ(narrow.world(0), (Position{double{0.1F}, double{-3e38F}, double{1e-40F}}));
}

TEST_F(E57Reader, IntegersOf32BitsStaySteps) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  const auto scan =
      read({.streams = {test::e57_scaled("cartesianX", kLeast, kMost,
                                         R"(scale="0.001" offset="500000")", {kLeast, -1, kMost}),
                        test::e57_scaled("cartesianY", -5, 6, R"(scale="0.25")", {-5, 0, 6}),
                        test::e57_integers("cartesianZ", 100, 100, {100, 100, 100})}});
  ASSERT_EQ(scan.info.encoding, PositionEncoding::kSteps);
  EXPECT_EQ(scan.info.scale, (Position{0.001, 0.25, 1}));
  EXPECT_EQ(scan.info.offset, (Position{500000, 0, 0}));
  using Steps = std::array<std::int32_t, 3>;
  EXPECT_THAT(scan.points.steps,
              ElementsAre(Steps{INT32_MIN, -5, 100}, Steps{-1, 0, 100}, Steps{INT32_MAX, 6, 100}));
}

TEST_F(E57Reader, StepsBeyond32BitsAndScalesBelow0BecomeFloats) {
  const auto with_x = [&](const E57Stream& x) {
    return read({.streams = {x, test::e57_integers("cartesianY", 0, 9, {7}),
                             test::e57_integers("cartesianZ", 0, 9, {8})}});
  };
  const auto wide = with_x(
      test::e57_scaled("cartesianX", 0, std::int64_t{1} << 40, R"(scale="0.5")", {1LL << 39}));
  EXPECT_EQ(wide.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(wide.world(0), (Position{std::ldexp(1, 38), 7, 8}));
  const auto mirrored = with_x(test::e57_scaled("cartesianX", 0, 100, R"(scale="-0.5")", {3}));
  EXPECT_EQ(mirrored.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(mirrored.world(0), (Position{-1.5, 7, 8}));
}

/// A value for any point and field.
std::uint64_t scrambled(std::uint64_t seed) {
  seed = (seed + 1) * 0x9e3779b97f4a7c15U;
  seed = (seed ^ (seed >> 29)) * 0xbf58476d1ce4e5b9U;
  return seed ^ (seed >> 32);
}

/// Points with an integer of each width from 1 to 64 bits, whatever they are.
E57ScanBytes scan_of_all_widths(std::size_t count) {
  E57ScanBytes scan{.streams = test::e57_line(count)};
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const std::uint64_t mask = ~std::uint64_t{0} >> (64 - bits);
    // Around 0, as signed numbers are.
    const auto least = bits == 64 ? INT64_MIN : -(std::int64_t{1} << (bits - 1));
    std::vector<std::int64_t> values;
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(static_cast<std::int64_t>((scrambled(64 * i + bits) & mask) +
                                                 static_cast<std::uint64_t>(least)));
    const auto most = static_cast<std::int64_t>(static_cast<std::uint64_t>(least) + mask);
    scan.streams.push_back(test::e57_integers("w" + std::to_string(bits), least, most, values));
  }
  return scan;
}

void expect_all_widths(const test::ScanPoints& scan, const E57ScanBytes& written) {
  ASSERT_EQ(scan.points.count, written.streams[0].values.size());
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const std::string name = "w" + std::to_string(bits);
    const Attribute& attribute = scan.info.schema.at(*find_attribute(scan.info.schema, name));
    EXPECT_EQ(attribute.size_bytes(), bits <= 8 ? 1U : bits <= 16 ? 2U : bits <= 32 ? 4U : 8U);
    const auto least =
        bits == 64 ? std::uint64_t{1} << 63 : ~((std::uint64_t{1} << (bits - 1)) - 1);
    for (std::size_t i = 0; i < scan.points.count; ++i) {
      const auto expected = static_cast<std::int64_t>(written.streams[bits + 2].values[i] + least);
      std::int64_t found = 0;
      if (bits <= 8)
        found = int{scan.value<std::int8_t>(name, i)};
      else if (bits <= 16)
        found = scan.value<std::int16_t>(name, i);
      else if (bits <= 32)
        found = scan.value<std::int32_t>(name, i);
      else
        found = scan.value<std::int64_t>(name, i);
      ASSERT_EQ(found, expected) << name << ", point " << i;
    }
    EXPECT_EQ(scan.world(scan.points.count - 1)[0], static_cast<double>(scan.points.count - 1));
  }
}

TEST_F(E57Reader, NumbersOfAnyWidthAreReadAcrossPackets) {
  const E57ScanBytes scan = scan_of_all_widths(3000);
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, StreamsMayBeOutOfStepAndCutAnywhere) {
  E57ScanBytes scan = scan_of_all_widths(700);
  // Pieces of a few bytes, each of another size; now and then none; the first stream far behind the last.
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    const std::size_t size = scrambled(packet * 67 + stream) % 97;
    if (left < 50) return left;
    return stream < 3 && packet < 40 ? size % 3 : size;
  };
  scan.before_packet = [](std::size_t packet) {
    if (packet % 5 == 2) return test::e57_index_packet();
    return packet % 7 == 3 ? test::e57_empty_packet(4 + 4 * packet) : std::string();
  };
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, OneStreamAfterTheOtherIsReadToo) {
  E57ScanBytes scan = scan_of_all_widths(1000);
  // As far out of step as can be: packet n holds of stream n alone.
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    return packet == stream ? left : 0;
  };
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, EmptyPacketsAreWalkedOverOnce) {
  // Packet n holds stream n alone, more of them than are kept at hand, each behind 256 KiB of empty packets.
  constexpr std::size_t kCount = 20000, kEmpty = std::size_t{64} << 10;
  E57ScanBytes scan;
  for (const char* name :
       {"cartesianX", "cartesianY", "cartesianZ", "a", "b", "c", "d", "e", "f", "g", "h", "i"}) {
    Values values;
    for (std::size_t i = 0; i < kCount; ++i)
      values.push_back(static_cast<std::int64_t>(scrambled(i + name[0]) % 65536));
    scan.streams.push_back(test::e57_integers(name, 0, 65535, values));
  }
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    return packet == stream ? left : 0;
  };
  scan.before_packet = [](std::size_t) {
    std::string run;
    for (int i = 0; i < 4; ++i) run += test::e57_empty_packet(kEmpty);
    return run;
  };
  const auto path = folder_.write("scan.e57", E57Bytes{.scans = {scan}}.bytes());
  const auto reader = test::open_scan(path);
  // Wrecked once the file is open: a page in each 64 that hold empty packets alone, as so many are read together.
  const std::string bytes = test::read_text(path);
  const auto is_empty = [&](std::size_t page) {
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(page * 1024);
    return std::count(begin, begin + 1020, '\xee') >= 1016;
  };
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::size_t wrecked = 0;
  for (std::size_t first = 0; (first + 64) * 1024 <= bytes.size(); first += 64) {
    bool all = true;
    for (std::size_t page = first; page < first + 64; ++page) all = all && is_empty(page);
    if (!all) continue;
    file.seekp(static_cast<std::streamoff>(first * 1024 + 500));
    file.put('\0');
    ++wrecked;
  }
  file.close();
  ASSERT_GE(wrecked, 12U * 3);
  const auto points = test::read_points(*reader);
  ASSERT_EQ(points.points.count, kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    ASSERT_EQ(points.value<std::uint16_t>("i", i), scan.streams.back().values[i]);
}

TEST_F(E57Reader, PagesMayHaveAnotherSize) {
  const E57ScanBytes scan = scan_of_all_widths(300);
  for (const std::size_t page_bytes : {std::size_t{512}, std::size_t{4096}, std::size_t{1} << 20})
    expect_all_widths(read_all({.page_bytes = page_bytes, .scans = {scan}}).at(0), scan);
}

TEST_F(E57Reader, ManyStretchesAreIndependent) {
  // An odd width, so that stretches begin inside of bytes; more than two stretches.
  constexpr std::size_t kCount = 600001;
  Values x, y, z, mark;
  for (std::size_t i = 0; i < kCount; ++i) {
    x.push_back(static_cast<std::int64_t>(i));
    y.push_back(static_cast<std::int64_t>(scrambled(i) % 8191));
    z.push_back(static_cast<std::int64_t>(i % 5));
    mark.push_back(i % 3 == 1 ? 2 : 0);
  }
  const E57ScanBytes written{.streams = {test::e57_integers("cartesianX", 0, kCount, x),
                                         test::e57_integers("cartesianY", 0, 8190, y),
                                         test::e57_integers("cartesianZ", 0, 4, z),
                                         test::e57_integers("cartesianInvalidState", 0, 2, mark)}};
  const auto reader =
      test::open_scan(folder_.write("scan.e57", E57Bytes{.scans = {written}}.bytes()));
  ASSERT_EQ(reader->stretch_count(), 3U);
  std::size_t seen = 0;
  // Last stretch first: none needs what another has read.
  for (std::size_t stretch = 3; stretch-- > 0;) {
    std::uint64_t next = stretch * 4 * kBlockPoints;
    reader->read(stretch, [&](const PointBlock& block) {
      for (const auto& step : block.steps) {
        while (next % 3 == 1) ++next;
        ASSERT_EQ(step[0], static_cast<std::int32_t>(next));
        ASSERT_EQ(step[1], y[next]);
        ASSERT_EQ(step[2], z[next]);
        ++next;
        ++seen;
      }
    });
  }
  EXPECT_EQ(seen, kCount - kCount / 3);
}

TEST_F(E57Reader, RecordsOfNoBitsAreAllTheSame) {
  const auto zero_width = [](std::size_t count) {
    const Values values(count, 7);
    return E57ScanBytes{.streams = {test::e57_integers("cartesianX", 7, 7, values),
                                    test::e57_integers("cartesianY", 7, 7, values),
                                    test::e57_integers("cartesianZ", 7, 7, values)},
                        .record_count = count};
  };
  const auto scan = read(zero_width(1000));
  ASSERT_EQ(scan.points.count, 1000U);
  EXPECT_EQ(scan.world(999), (Position{7, 7, 7}));
  // A count without a byte behind it is believed up to a bound.
  try {
    read(zero_width(65537));
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("all points are told to be the same"));
  }
}

TEST_F(E57Reader, InvalidPointsAreNone) {
  E57ScanBytes scan{.streams = test::e57_line(5)};
  scan.streams.push_back(test::e57_integers("cartesianInvalidState", 0, 2, {0, 1, 2, 0, 2}));
  scan.streams.push_back(test::e57_integers("rowIndex", 0, 300, {10, 11, 12, 300, 14}));
  // Both are no point, whatever their other values.
  scan.streams[4].values[2] = 511;
  const auto points = read(scan);
  EXPECT_EQ(points.info.claimed_points, 5U);
  EXPECT_EQ(points.points.no_return, 3U);
  ASSERT_EQ(points.points.count, 2U);
  EXPECT_EQ(points.world(1), (Position{3, 6, 9}));
  EXPECT_THAT(points.names(), ElementsAre("row_index"));
  EXPECT_EQ(points.value<std::uint16_t>("row_index", 1), 300);
}

TEST_F(E57Reader, SphericalCoordinatesAreSeenFromTheSensor) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const auto scan =
      read({.streams = {test::e57_doubles("sphericalRange", {2, 3, 5, 4}),
                        test::e57_doubles("sphericalAzimuth", {0, kQuarter, 1, -kQuarter}),
                        test::e57_doubles("sphericalElevation", {0, 0, 1, kQuarter / 3}),
                        test::e57_integers("sphericalInvalidState", 0, 2, {0, 0, 1, 0})}});
  EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(scan.info.sensor, (Vector3{0, 0, 0}));
  EXPECT_EQ(scan.points.no_return, 1U);
  ASSERT_EQ(scan.points.count, 3U);
  const std::array<Position, 3> expected{{{2, 0, 0}, {0, 3, 0}, {0, -2 * std::sqrt(3.0), 2}}};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(scan.world(i)[axis], expected[i][axis], 1e-15);
}

TEST_F(E57Reader, OfBothKindsOfCoordinatesTheCartesianOnesAreTaken) {
  E57ScanBytes scan{.streams = test::e57_line(2)};
  for (const char* name : {"sphericalRange", "sphericalAzimuth", "sphericalElevation"})
    scan.streams.push_back(test::e57_doubles(name, {1, 1}));
  scan.streams.push_back(test::e57_integers("sphericalInvalidState", 0, 2, {2, 2}));
  const auto points = read(scan);
  EXPECT_EQ(points.points.count, 2U);
  EXPECT_EQ(points.world(1), (Position{1, 2, 3}));
  EXPECT_THAT(points.names(), ElementsAre());
  EXPECT_FALSE(points.info.sensor);
}

TEST_F(E57Reader, PosesPlacePointsAndTurnNormals) {
  E57ScanBytes scan{.streams = test::e57_line(2), .xml = kEighthTurnAndMove};
  scan.streams.push_back(test::e57_floats("nor:normalX", {1, 0}));
  scan.streams.push_back(test::e57_floats("nor:normalY", {0, 1}));
  scan.streams.push_back(test::e57_floats("nor:normalZ", {0, 0}));
  const auto scans = read_all({.scans = {scan, {.streams = test::e57_line(1)}}});
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].info.part, "scan 1");
  EXPECT_EQ(scans[1].info.part, "scan 2");
  // w = z: a quarter turn about z (of a quaternion that is not of length 1). (1, 2, 3) goes to (-2, 1, 3).
  const Position expected{8, 21, 33};
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(scans[0].world(1)[axis], expected[axis], 1e-14);
  ASSERT_TRUE(scans[0].info.sensor);
  EXPECT_EQ(*scans[0].info.sensor, (Vector3{10, 20, 30}));
  EXPECT_NEAR(scans[0].value<float>("normal", 0, 0), 0, 1e-7);
  EXPECT_NEAR(scans[0].value<float>("normal", 0, 1), 1, 1e-7);
  EXPECT_NEAR(scans[0].value<float>("normal", 1, 0), -1, 1e-7);
  EXPECT_FALSE(scans[1].info.sensor);
  EXPECT_EQ(scans[1].world(0), (Position{0, 0, 0}));
}

TEST_F(E57Reader, TheSensorIsKnownOfStationsOnly) {
  const std::string still =
      "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">1</w></rotation>"
      "<translation type=\"Structure\"/></pose>";
  E57ScanBytes scan{.streams = test::e57_line(2), .xml = still};
  EXPECT_FALSE(read(scan).info.sensor);
  scan.xml = "<pose type=\"Structure\"/>";
  EXPECT_FALSE(read(scan).info.sensor);
  scan.xml = kEighthTurnAndMove;
  EXPECT_EQ(read(scan).info.sensor, (Vector3{10, 20, 30}));
  for (const char* index : {"rowIndex", "columnIndex"}) {
    E57ScanBytes grid{.streams = test::e57_line(2), .xml = still};
    grid.streams.push_back(test::e57_integers(index, 0, 9, {1, 2}));
    EXPECT_EQ(read(grid).info.sensor, (Vector3{0, 0, 0})) << index;
  }
}

TEST_F(E57Reader, ColorsOfFullScaleStayAsTheyAre) {
  const auto narrow = read({.streams = line_with_colors(0, 255, {0, 255}, {1, 2}, {128, 7})});
  EXPECT_EQ(narrow.value<std::uint8_t>("color", 1, 0), 255);
  EXPECT_EQ(narrow.value<std::uint8_t>("color", 0, 2), 128);
  const auto wide = read({.streams = line_with_colors(0, 65535, {0, 65535}, {300, 2}, {4, 7})});
  EXPECT_EQ(wide.value<std::uint16_t>("color", 1, 0), 65535);
  EXPECT_EQ(wide.value<std::uint16_t>("color", 0, 1), 300);
  // Limits that are what the scan holds are no scale.
  const auto held = read({.streams = line_with_colors(0, 255, {0, 90}, {1, 2}, {80, 7}),
                          .xml = color_limits("Integer", "90")});
  EXPECT_EQ(held.value<std::uint8_t>("color", 1, 0), 90);
  // Eight bits in a wider field.
  const auto eight = read({.streams = line_with_colors(0, 65535, {0, 255}, {9, 2}, {4, 7}),
                           .xml = color_limits("Integer", "255")});
  EXPECT_EQ(eight.value<std::uint8_t>("color", 1, 0), 255);
  EXPECT_EQ(eight.value<std::uint8_t>("color", 0, 1), 9);
}

TEST_F(E57Reader, LimitsThatAreOfFewBitsOrOfSomeChannelsAreNoScale) {
  for (const char* most : {"1", "3", "127"}) {
    const auto held = read({.streams = line_with_colors(0, 255, {0, 1}, {1, 0}, {1, 1}),
                            .xml = color_limits("Integer", most)});
    EXPECT_EQ(held.value<std::uint8_t>("color", 1, 0), 1) << most;
  }
  // The darkest channel ends at 127 or at 255 by chance: as all stay as they are, so does the hue.
  const auto with_dark_blue = [&](std::int64_t most, const char* limit, const char* dark) {
    std::string xml = color_limits("Integer", limit);
    xml.replace(xml.find('>', xml.rfind("<colorBlueMaximum")) + 1, 3, dark);
    return read({.streams = line_with_colors(0, most, {0, 100}, {0, 100}, {0, 100}), .xml = xml});
  };
  const auto eight = with_dark_blue(255, "203", "127"), ten = with_dark_blue(1023, "803", "255");
  for (std::size_t channel = 0; channel < 3; ++channel) {
    EXPECT_EQ(eight.value<std::uint8_t>("color", 1, channel), 100);
    EXPECT_EQ(ten.value<std::uint16_t>("color", 1, channel), 6406);  // 100 * 65535 / 1023 = 6406.2
  }
  // Nothing goes beyond what the fields hold.
  const auto beyond = read({.streams = line_with_colors(0, 255, {0, 90}, {1, 2}, {80, 7}),
                            .xml = color_limits("Integer", "65535")});
  EXPECT_EQ(beyond.value<std::uint8_t>("color", 1, 0), 90);
}

TEST_F(E57Reader, ChannelsOfOneValueStayAsTheyAre) {
  E57ScanBytes scan{.streams = line_with_colors(0, 255, {0, 255}, {1, 2}, {3, 4})};
  scan.streams[4] = test::e57_integers("colorGreen", 200, 200, {200, 200});
  const auto one = read(scan);
  EXPECT_EQ(one.value<std::uint8_t>("color", 1, 0), 255);
  EXPECT_EQ(one.value<std::uint8_t>("color", 1, 1), 200);
  EXPECT_EQ(one.value<std::uint8_t>("color", 1, 2), 4);
  const auto all = read({.streams = line_with_colors(200, 200, {200}, {200}, {200})});
  EXPECT_EQ(all.value<std::uint8_t>("color", 0, 2), 200);
  const auto wide = read({.streams = line_with_colors(300, 300, {300}, {300}, {300})});
  EXPECT_EQ(wide.value<std::uint16_t>("color", 0, 2), 300);
  // A least value that no one tells is that of 64 bits, and no range.
  E57ScanBytes open{.streams = line_with_colors(INT64_MIN, 255, {7, 255}, {1, 2}, {3, 4})};
  EXPECT_EQ(read(open).value<std::uint8_t>("color", 0, 0), 7);
}

TEST_F(E57Reader, OtherColorsAreScaledByTheirLimits) {
  // Ten bits, in a field of ten and of sixteen.
  for (const std::int64_t most : {1023, 65535}) {
    const auto ten = read({.streams = line_with_colors(0, most, {0, 1023}, {1, 511}, {512, 7}),
                           .xml = color_limits("Integer", "1023")});
    EXPECT_EQ(ten.value<std::uint16_t>("color", 1, 0), 65535);
    EXPECT_EQ(ten.value<std::uint16_t>("color", 0, 1), 64);     // 65535 / 1023 = 64.06
    EXPECT_EQ(ten.value<std::uint16_t>("color", 1, 1), 32735);  // 511 * 64.0616
  }
  E57ScanBytes floats{.streams = test::e57_line(4), .xml = color_limits("Float", "2")};
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  floats.streams.push_back(test::e57_floats("colorRed", {0, 1, 2, 3}));
  floats.streams.push_back(test::e57_floats("colorGreen", {-1, kNone, 0.5F, 1e30F}));
  floats.streams.push_back(test::e57_floats("colorBlue", {0, 0, 0, 0}));
  const auto scan = read(floats);
  const auto color = [&](std::size_t i, std::size_t channel) {
    return scan.value<std::uint16_t>("color", i, channel);
  };
  EXPECT_EQ(color(1, 0), 32768);
  EXPECT_EQ(color(2, 0), 65535);
  EXPECT_EQ(color(3, 0), 65535);
  EXPECT_EQ(color(0, 1), 0);
  EXPECT_EQ(color(1, 1), 0);
  EXPECT_EQ(color(2, 1), 16384);
  EXPECT_EQ(color(3, 1), 65535);
}

TEST_F(E57Reader, InvalidColorsIntensitiesAndTimesAreZero) {
  E57ScanBytes scan{.streams = line_with_colors(0, 255, {1, 2}, {3, 4}, {5, 6})};
  scan.streams.push_back(test::e57_integers("isColorInvalid", 0, 1, {0, 1}));
  scan.streams.push_back(test::e57_scaled("intensity", -5, 5, R"(scale="0.5")", {4, 4}));
  scan.streams.push_back(test::e57_integers("isIntensityInvalid", 0, 1, {1, 0}));
  scan.streams.push_back(test::e57_doubles("timeStamp", {1.25, 2.5}));
  scan.streams.push_back(test::e57_integers("isTimeStampInvalid", 0, 1, {0, 1}));
  const auto points = read(scan);
  EXPECT_THAT(points.names(), ElementsAre("color", "intensity", "gps_time"));
  EXPECT_EQ(points.value<std::uint8_t>("color", 0, 2), 5);
  EXPECT_EQ(points.value<std::uint8_t>("color", 1, 2), 0);
  EXPECT_EQ(points.value<float>("intensity", 0), 0);
  EXPECT_EQ(points.value<float>("intensity", 1), 2);
  EXPECT_EQ(points.value<double>("gps_time", 0), 1.25);
  EXPECT_EQ(points.value<double>("gps_time", 1), 0);
}

TEST_F(E57Reader, ReturnsAreCountedFromOne) {
  E57ScanBytes scan{.streams = test::e57_line(2)};
  scan.streams.push_back(test::e57_integers("returnIndex", 0, 3, {0, 2}));
  scan.streams.push_back(test::e57_integers("returnCount", 0, 3, {1, 3}));
  const auto points = read(scan);
  EXPECT_THAT(points.names(), ElementsAre("return_number", "return_count"));
  EXPECT_EQ(points.value<std::uint8_t>("return_number", 0), 1);
  EXPECT_EQ(points.value<std::uint8_t>("return_number", 1), 3);
  EXPECT_EQ(points.value<std::uint8_t>("return_count", 1), 3);
  // Elements of LAS tell that a LAS file's numbers were kept, which are from 1 on.
  scan.streams[3] = test::e57_integers("returnIndex", 0, 3, {1, 3});
  for (const char* element : {"las:classification", "las:fileSourceId"}) {
    E57ScanBytes las = scan;
    if (element == std::string("las:classification"))
      las.streams.push_back(test::e57_integers(element, 0, 31, {2, 6}));
    else
      las.xml = "<las:fileSourceId type=\"Integer\"/>";
    EXPECT_EQ(read(las).value<std::uint8_t>("return_number", 0), 1) << element;
    EXPECT_EQ(read(las).value<std::uint8_t>("return_number", 1), 3) << element;
  }
}

TEST_F(E57Reader, OtherNumbersAreKeptByNameInTheirTypes) {
  E57ScanBytes scan{.streams = test::e57_line(1)};
  scan.streams.push_back(test::e57_integers("columnIndex", 0, 70000, {69999}));
  scan.streams.push_back(test::e57_integers("las:pointSourceId", 0, 65535, {513}));
  scan.streams.push_back(test::e57_integers("las:classification", 0, 31, {6}));
  scan.streams.push_back(test::e57_integers("acme:signedThing", -90, 90, {-90}));
  scan.streams.push_back(test::e57_doubles("acme:temperature", {36.6}));
  scan.streams.push_back(test::e57_scaled("acme:reflectance", 0, 1000, R"(scale="0.01")", {250}));
  const auto points = read(scan);
  EXPECT_THAT(points.names(), ElementsAre("column_index", "point_source_id", "classification",
                                          "signed_thing", "temperature", "reflectance"));
  EXPECT_EQ(points.value<std::uint32_t>("column_index", 0), 69999U);
  EXPECT_EQ(points.value<std::uint16_t>("point_source_id", 0), 513);
  EXPECT_EQ(points.value<std::uint8_t>("classification", 0), 6);
  EXPECT_EQ(points.value<std::int8_t>("signed_thing", 0), -90);
  EXPECT_EQ(points.value<double>("temperature", 0), 36.6);
  EXPECT_EQ(points.value<float>("reflectance", 0), 2.5F);
}

TEST_F(E57Reader, StringsAndNestedFieldsDoNotShiftTheOthers) {
  E57ScanBytes scan{.streams = {}};
  // A string of two characters a record: its length times 2, then the characters.
  E57Stream text{"<acme:label type=\"String\"/>", 24, {0x626104, 0x646304}};
  E57Stream nested = test::e57_integers("depth", 0, 255, {3, 4});
  nested.xml = "<acme:group type=\"Structure\">" + nested.xml + "</acme:group>";
  scan.streams = {text, nested};
  for (const E57Stream& axis : test::e57_line(2)) scan.streams.push_back(axis);
  scan.record_count = 2;
  const auto points = read(scan);
  ASSERT_EQ(points.points.count, 2U);
  EXPECT_EQ(points.world(1), (Position{1, 2, 3}));
  ASSERT_EQ(points.info.schema.size(), 1U);
  EXPECT_EQ(points.value<std::uint8_t>(points.info.schema[0].name, 1), 4);
}

TEST_F(E57Reader, ACoordinateSystemIsKeptIfItIsWkt) {
  const auto crs_of = [&](const std::string& text) {
    return read_all({.scans = {{.streams = test::e57_line(1)}},
                     .root_xml =
                         "<coordinateMetadata type=\"String\">" + text + "</coordinateMetadata>"})
        .at(0)
        .info.crs;
  };
  const auto crs = crs_of("<![CDATA[PROJCS[\"somewhere\"]]]>");
  ASSERT_EQ(crs.size(), 1U);
  EXPECT_EQ(crs[0].record_id, 2112);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(crs[0].data.data())),
            "PROJCS[\"somewhere\"]");
  // The long forms of ISO 19162.
  for (const char* text : {"PROJECTEDCRS[\"a\"]", "GEODETICCRS[\"a\"]", "GEOGRAPHICCRS[\"a\"]"})
    EXPECT_EQ(crs_of(text).size(), 1U) << text;
  EXPECT_TRUE(crs_of("").empty());
  EXPECT_TRUE(crs_of("somewhere in the hills").empty());
}

TEST_F(E57Reader, IntensityLimitsAreToldInUnitsOfTheValues) {
  const auto limits_of = [&](const std::string& xml) {
    return read_with(test::e57_integers("intensity", 0, 2047, {1, 2, 3}),
                     "<intensityLimits type=\"Structure\">" + xml + "</intensityLimits>")
        .info.intensity_limits;
  };
  using Limits = std::array<double, 2>;
  EXPECT_EQ(limits_of("<intensityMinimum type=\"Integer\"/>"
                      "<intensityMaximum type=\"Integer\">2047</intensityMaximum>"),
            (Limits{0, 2047}));
  EXPECT_EQ(
      limits_of("<intensityMinimum type=\"Float\">-1</intensityMinimum>"
                "<intensityMaximum type=\"ScaledInteger\" scale=\"0.5\">3</intensityMaximum>"),
      (Limits{-1, 1.5}));
  EXPECT_FALSE(limits_of(""));
  EXPECT_FALSE(
      limits_of("<intensityMinimum type=\"Float\">7</intensityMinimum>"
                "<intensityMaximum type=\"Float\">7</intensityMaximum>"));
}

TEST_F(E57Reader, ScansWithoutPointsAreEmpty) {
  E57ScanBytes none{.streams = test::e57_line(0)};
  EXPECT_EQ(read(none).points.count, 0U);
  none.tamper = [](std::string& section) { section[0] = '\xb6'; };
  EXPECT_EQ(read(none).points.count, 0U);
}

}  // namespace
}  // namespace cairn::formats
