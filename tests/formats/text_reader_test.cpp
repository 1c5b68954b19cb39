// Texts of numbers, written by hand for each rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "formats/error.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Position = std::array<double, 3>;

class TextReader : public ::testing::Test {
 protected:
  test::ScanPoints read(const std::string& name, const std::string& text,
                        const ScanOptions& options = {}) {
    return test::read_points(folder_.write(name, text), options);
  }
  test::ScanPoints read(const std::string& text) { return read("scan.xyz", text); }

  /// The message of the refusal.
  std::string refusal(const std::string& name, const std::string& text,
                      const ScanOptions& options = {}) {
    try {
      read(name, text, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(name));
      return error.what();
    }
    ADD_FAILURE() << "not refused: " << text;
    return "";
  }

  static ScalarType type_of(const test::ScanPoints& scan, const std::string& name) {
    return scan.info.schema.at(find_attribute(scan.info.schema, name).value()).type;
  }

  test::TemporaryFolder folder_;
};

TEST_F(TextReader, TakesBlanksTabsCommasAndSemicolonsWithEitherLineEnd) {
  for (const char* text :
       {"1 2 3\n4.5 -5e1 6\n", "1\t2\t3\r\n4.5\t-5e1\t6\r\n", "1,2,3\n4.5, -5e1, 6",
        "1;2;3\n4.5; -5e1;6;\n", "  1   2 3  \n\n\t4.5 -5e1 +6\n",
        "\xef\xbb\xbf"
        "1 2 3\n4.5 -50 6"}) {
    SCOPED_TRACE(text);
    const auto scan = read(text);
    ASSERT_EQ(scan.points.count, 2U);
    EXPECT_EQ(scan.info.encoding, PositionEncoding::kFloat64);
    EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
    EXPECT_EQ(scan.world(1), (Position{4.5, -50, 6}));
    EXPECT_THAT(scan.names(), IsEmpty());
    EXPECT_EQ(scan.info.claimed_points, 2U);
  }
}

// Else all rows but the first would be taken for further values of it, or for a comment.
TEST_F(TextReader, RefusesLinesThatEndWithACarriageReturnAlone) {
  for (const char* text : {"1 2 3\r4 5 6\r7 8 9\r", "1 2 3\r4 5 6", "# x y z\r1 2 3\r",
                           "x,y,z\r1,2,3\r", "1 2 3\n4 5 6\r7 8 9\n"})
    EXPECT_THAT(refusal("a.xyz", text), HasSubstr("a carriage return amid a line"));
  EXPECT_THAT(refusal("a.ptx", "1\r1\r0 0 0\r"), HasSubstr("a carriage return amid a line"));
  EXPECT_EQ(read("1 2 3\r\r\n4 5 6\r\r\n").points.count, 2U);
}

TEST_F(TextReader, PassesOverComments) {
  const auto scan = read("# of the site\n// by hand\n1 2 3\n  # between\n4 5 6\n#end\n");
  ASSERT_EQ(scan.points.count, 2U);
  EXPECT_EQ(scan.world(1), (Position{4, 5, 6}));
}

TEST_F(TextReader, TakesNamesInManySpellings) {
  const auto scan =
      read("scan.csv",
           "Northing,Easting,Height,\"R\",G,B,Scalar_Intensity,NormalX,NormalY,NormalZ,"
           "Classification,GpsTime,Deviation [m]\n"
           "2,1,3,10,20,30,-7,0,0.6,0.8,5,17.25,0.125\n");
  EXPECT_EQ(scan.world(0), (Position{1, 2, 3}));
  EXPECT_THAT(scan.names(), ElementsAre("normal", "color", "intensity", "classification",
                                        "gps_time", "deviation_m"));
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 0), 10);
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 2), 30);
  EXPECT_EQ(scan.value<std::int8_t>("intensity", 0), -7);
  EXPECT_EQ(scan.value<float>("normal", 0, 2), 0.8F);
  EXPECT_EQ(scan.value<std::uint8_t>("classification", 0), 5);
  EXPECT_EQ(scan.value<double>("gps_time", 0), 17.25);
  EXPECT_EQ(scan.value<float>("deviation_m", 0), 0.125F);
}

TEST_F(TextReader, TakesNamesFromACommentBeforeTheRows) {
  const auto scan =
      read("//X Y Z R G B Height_above\n2\n1 2 3 117.0 0.0 255.0 1.5\n4 5 6 1 2 3 0.5\n");
  ASSERT_EQ(scan.points.count, 2U);
  EXPECT_THAT(scan.names(), ElementsAre("color", "height_above"));
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 0), 117);
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 2), 255);
  // A comment that names as many things as no row has values is talk.
  EXPECT_THAT(read("# x y z are metres\n1 2 3\n").names(), IsEmpty());
}

TEST_F(TextReader, RecognisesColumnsByNumberAndValues) {
  EXPECT_THAT(read("1 2 3 4\n").names(), ElementsAre("intensity"));
  EXPECT_THAT(read("1 2 3 0 128 255\n").names(), ElementsAre("color"));
  EXPECT_THAT(read("1 2 3 0 0.6 -0.8\n4 5 6 0 0 0\n").names(), ElementsAre("normal"));
  EXPECT_THAT(read("1 2 3 1 2 300\n").names(), ElementsAre("column_4", "column_5", "column_6"));
  EXPECT_THAT(read("1 2 3 0.5\n").names(), ElementsAre("intensity"));
  EXPECT_THAT(read("1 2 3 10 20 30 255\n").names(), ElementsAre("color", "column_7"));
  EXPECT_THAT(read("1 2 3 -1613 52 70 64\n").names(), ElementsAre("color", "intensity"));
  EXPECT_THAT(read("1 2 3 9 8 7 0.6 0 0.8\n").names(), ElementsAre("normal", "color"));
  EXPECT_THAT(read("1 2 3 9.5 8\n").names(), ElementsAre("column_4", "column_5"));
}

// The last row decides as much as the first.
TEST_F(TextReader, DecidesFromTheValuesOfAllRows) {
  std::string rows;
  for (int i = 0; i < 5000; ++i) rows += "1 2 3 7 8 9\n";
  EXPECT_EQ(read(rows).names(), std::vector<std::string>{"color"});
  EXPECT_EQ(read(rows + "1 2 3 7 8 256\n").names().size(), 3U);
}

TEST_F(TextReader, PtsHasIntensityBeforeColors) {
  const auto scan = read("scan.pts", "2\n1 2 3 100 52 70 64\n4 5 6 -1613 1 2 3\n");
  EXPECT_THAT(scan.names(), ElementsAre("color", "intensity"));
  EXPECT_EQ(scan.value<std::int16_t>("intensity", 0), 100);
  EXPECT_EQ(scan.value<std::int16_t>("intensity", 1), -1613);
  EXPECT_EQ(scan.value<std::uint8_t>("color", 0, 2), 64);
}

TEST_F(TextReader, ExtraColumnsHaveTheNarrowestTypeThatHoldsAllValues) {
  const auto scan = read(
      "x y z a1 a2 a3 a4 a5 a6 a7\n"
      "1 2 3 0 -128 256 65536 -70000 0.123456 0.1234567\n"
      "1 2 3 255 127 1.0 1 9000000000 1 nan\n");
  EXPECT_EQ(type_of(scan, "a1"), ScalarType::kU8);
  EXPECT_EQ(type_of(scan, "a2"), ScalarType::kI8);
  EXPECT_EQ(type_of(scan, "a3"), ScalarType::kU16);
  EXPECT_EQ(type_of(scan, "a4"), ScalarType::kU32);
  EXPECT_EQ(type_of(scan, "a5"), ScalarType::kI64);
  EXPECT_EQ(type_of(scan, "a6"), ScalarType::kF32);
  EXPECT_EQ(type_of(scan, "a7"), ScalarType::kF64);
  EXPECT_EQ(scan.value<std::int64_t>("a5", 1), 9000000000);
  EXPECT_EQ(scan.value<std::uint16_t>("a3", 1), 1);
  EXPECT_EQ(scan.value<double>("a7", 0), 0.1234567);
  EXPECT_TRUE(std::isnan(scan.value<double>("a7", 1)));
}

TEST_F(TextReader, ColumnsMayBeGiven) {
  const auto scan = read("scan.txt", "a;b;c;d;e\nleft out;3;2;1;9\nleft out;6;5;4;8\n",
                         {.columns = {"_", "z", "y", "x", "intensity"}});
  ASSERT_EQ(scan.points.count, 2U);
  EXPECT_EQ(scan.world(1), (Position{4, 5, 6}));
  EXPECT_THAT(scan.names(), ElementsAre("intensity"));
  // Without a line of names, the first row is not lost.
  EXPECT_EQ(read("scan.txt", "n 1 2 3\n", {.columns = {"_", "x", "y", "z"}}).points.count, 1U);
  EXPECT_THAT(refusal("scan.txt", "1 2 3\n", {.columns = {"x", "y", "z", "intensity"}}),
              HasSubstr("found 3 values, expected 4"));
}

TEST_F(TextReader, RefusesWhatIsNoRowNamingLineAndOffset) {
  EXPECT_THAT(refusal("a.xyz", "1 2 3\n4 5\n"), HasSubstr("line 2: too few values"));
  EXPECT_THAT(refusal("a.xyz", "1 2 3\n4 5\n"), HasSubstr("at byte 6:"));
  EXPECT_THAT(refusal("a.xyz", "1 2 3\n#\n4 5 6 7\n"), HasSubstr("line 3: too many values"));
  EXPECT_THAT(refusal("a.xyz", "1 2 3\n4 five 6\n"), HasSubstr("found five"));
  EXPECT_THAT(refusal("a.xyz", "1 2 3 4\n4 5 6 x\n"), HasSubstr("line 2: value 4 is damaged"));
  EXPECT_THAT(refusal("a.csv", "1,2,3\n4,,6\n"), HasSubstr("line 2: value 2 is empty"));
  EXPECT_THAT(refusal("a.csv", "x,y,z\n1,2,3,4\n"), HasSubstr("names and values differ"));
  EXPECT_THAT(refusal("a.csv", "a,b,c\n1,2,3\n"), HasSubstr("line 1: neither numbers nor names"));
  EXPECT_THAT(refusal("a.csv", "1,5;2,5;3,5\n"), HasSubstr("line 1"));  // decimal commas
  EXPECT_THAT(refusal("a.xyz", "1 2\n3 4\n"), HasSubstr("no row of points"));
  EXPECT_THAT(refusal("a.xyz", "# nothing\n"), HasSubstr("a text without points"));
  EXPECT_THAT(refusal("a.xyz", ""), HasSubstr("not a scan"));
  EXPECT_THAT(refusal("a.pts", std::string("[binary]\n\0\1\2", 12)), HasSubstr("line 1"));
}

TEST_F(TextReader, NamesTheFieldThatIsEmpty) {
  EXPECT_THAT(refusal("a.csv", "1,2,3,,5\n"), HasSubstr("line 1: value 4 is empty"));
  EXPECT_THAT(refusal("a.csv", "x,y,z,i\n1,,3,4\n"), HasSubstr("line 2: value 2 is empty"));
  EXPECT_THAT(refusal("a.csv", "x,y,z,i\n1,2,3,\n"), HasSubstr("line 2: value 4 is empty"));
  EXPECT_THAT(refusal("a.csv", "1;2;3;4\n4;5;6; \n"), HasSubstr("line 2: value 4 is empty"));
  EXPECT_EQ(read("a.csv", "x,y,z,\n1,2,3,\n").points.count, 1U);
}

// Of the named and of the given columns, the first of each axis is the position.
TEST_F(TextReader, ASecondHeightIsAnAttribute) {
  for (const auto& scan : {read("a.csv", "x,y,z,height,Easting\n1.5,2,3,0.7,4000000000\n"),
                           read("b.csv", "1.5,2,3,0.7,4000000000\n",
                                {.columns = {"x", "y", "z", "height", "Easting"}})}) {
    EXPECT_EQ(scan.world(0), (Position{1.5, 2, 3}));
    EXPECT_THAT(scan.names(), ElementsAre("height", "easting"));
    EXPECT_EQ(scan.value<float>("height", 0), 0.7F);
    EXPECT_EQ(scan.value<std::uint32_t>("easting", 0), 4000000000U);
  }
}

TEST_F(TextReader, NumbersOfUint64AreExact) {
  const auto scan = read("x y z id\n1 2 3 18446744073709551615\n4 5 6 0\n");
  EXPECT_EQ(scan.value<std::uint64_t>("id", 0), 18446744073709551615U);
}

TEST_F(TextReader, CountsAreCheckedAndAddUp) {
  EXPECT_EQ(read("a.pts", "2\n1 2 3\n4 5 6\n1\n7 8 9\n").points.count, 3U);
  EXPECT_EQ(read("a.pts", "0\n").points.count, 0U);
  EXPECT_EQ(read("a.pts", "0\n1\n7 8 9\n").points.count, 1U);
  EXPECT_THAT(refusal("a.pts", "3\n1 2 3\n4 5 6\n"), HasSubstr("found 2 whole rows, expected 3"));
  EXPECT_THAT(refusal("a.pts", "2\n1 2 3\n1\n7 8 9\n"), HasSubstr("line 3: a block of points"));
  EXPECT_THAT(refusal("a.pts", "1 2 3\n1\n7 8 9\n"), HasSubstr("line 2: too few values"));
  EXPECT_THAT(refusal("a.pts", "0\n18446744073709551615\n1 2 3\n"), HasSubstr("expected 1844"));
  EXPECT_THAT(refusal("a.pts", "1\n1 2 3\n18446744073709551615\n1 2 3\n"),
              HasSubstr("more points are promised than can be counted"));
}

TEST_F(TextReader, KeepsRowsBeyondTheCount) {
  const auto scan = read("a.pts", "1\n1 2 3\n4 5 6\n7 8 9");
  EXPECT_EQ(scan.points.count, 3U);
  EXPECT_EQ(scan.info.claimed_points, 3U);
}

TEST_F(TextReader, AllowTruncatedKeepsWholeRowsAndCountsTheRest) {
  const ScanOptions allow{.allow_truncated = true};
  // The last row may have lost digits.
  const auto counted = read("a.pts", "4\n1 2 3\n4 5 6\n7 8 9", allow);
  EXPECT_EQ(counted.points.count, 2U);
  EXPECT_EQ(counted.info.claimed_points, 4U);
  EXPECT_THAT(refusal("a.xyz", "1 2 3\n4 5 6\n7 8"), HasSubstr("line 3: the last row is cut off"));
  const auto cut = read("a.xyz", "1 2 3\n4 5 6\n7 8", allow);
  EXPECT_EQ(cut.points.count, 2U);
  EXPECT_EQ(cut.info.claimed_points, 3U);
  EXPECT_EQ(read("a.xyz", "1 2 3\n4 5 6\n7 8 -", allow).points.count, 2U);
  // The begin of a row, not a count of the next block.
  EXPECT_THAT(refusal("a.pts", "2\n1 2 3\n4 5 6\n12"), HasSubstr("the last row is cut off"));
  const auto begun = read("a.pts", "2\n1 2 3\n4 5 6\n12", allow);
  EXPECT_EQ(begun.points.count, 2U);
  EXPECT_EQ(begun.info.claimed_points, 3U);
}

TEST_F(TextReader, ContentDecidesWhereTheSuffixTellsNothing) {
  EXPECT_EQ(read("scan", "1 2 3\n").points.count, 1U);
  EXPECT_EQ(read("scan.dat", "1\n1 2 3\n").points.count, 1U);
  EXPECT_THAT(refusal("scan.dat", "one two three\n"), HasSubstr("not a scan"));
  EXPECT_THAT(refusal("scan.las", "1 2 3\n"), HasSubstr("not a scan"));
}

// Two stretches and a bit: the same points as a plain parse finds.
TEST_F(TextReader, StretchesFollowEachOther) {
  constexpr std::size_t kRows = 2 * 262144 + 1000;
  std::string text = "#\n";
  for (std::size_t i = 0; i < kRows; ++i) {
    text +=
        std::to_string(i) + " " + std::to_string(i % 977) + " -1 " + std::to_string(i % 300) + "\n";
    if (i % 100000 == 99999) text += "\n# still more\n";
  }
  const auto reader = test::open_scan(folder_.write("long.xyz", text));
  ASSERT_EQ(reader->stretch_count(), 3U);
  EXPECT_EQ(reader->stretch_capacity(0), 262144U);
  EXPECT_EQ(reader->stretch_capacity(2), 1000U);
  const auto scan = test::read_points(*reader);
  ASSERT_EQ(scan.points.count, kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    ASSERT_EQ(scan.world(i), (Position{static_cast<double>(i), static_cast<double>(i % 977), -1}));
    ASSERT_EQ(scan.value<std::uint16_t>("intensity", i), i % 300);
  }
}

TEST_F(TextReader, NamesTheLineOfDamageInALaterStretch) {
  std::string text;
  for (int i = 0; i < 300000; ++i) text += i == 280000 ? "1 2 x\n" : "1 2 3\n";
  EXPECT_THAT(refusal("a.xyz", text), HasSubstr("line 280001"));
  EXPECT_THAT(refusal("a.xyz", text), HasSubstr("at byte 1680000:"));
}

}  // namespace
}  // namespace cairn::formats
