// What the fields of E57 files mean, built for each rule: coordinates, poses, colors, and all else that is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tests/formats/e57_fixture.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using Position = std::array<double, 3>;
using test::E57ScanBytes;
using test::E57Stream;
using Values = std::vector<std::int64_t>;

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
