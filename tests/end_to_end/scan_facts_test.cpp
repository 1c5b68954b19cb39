// What scans tell beside their points: coordinate systems, colors of 8 bits in fields of 16, scales of extra bytes. LAS files
// made byte by byte, and real ones.
#include <algorithm>
#include <array>
#include <cstring>

#include "tests/end_to_end/program_test.h"
#include "tests/support/e57_bytes.h"
#include "tests/support/las_bytes.h"
#include "tests/support/las_points.h"
#include "tests/support/shared_data.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

/// GeoTIFF keys, each with its value in place.
std::string geo_keys(const std::vector<std::pair<int, int>>& values) {
  std::string data;
  for (const int word : {1, 1, 0, static_cast<int>(values.size())})
    put(data, static_cast<std::uint16_t>(word));
  for (const auto& [key, value] : values)
    for (const int word : {key, 0, 1, value}) put(data, static_cast<std::uint16_t>(word));
  return vlr_bytes("LASF_Projection", 34735, data);
}

class ScanFacts : public ProgramTest {
 protected:
  /// Ten points of format 2 (colors), or more bytes behind them.
  std::string las(const std::string& name, const std::vector<std::string>& vlrs,
                  std::uint16_t brightest = 65535, const std::string& extra = "") {
    LasBytes las{.minor = 4, .point_format = 2};
    las.vlrs = vlrs;
    for (std::int32_t i = 0; i < 10; ++i) {
      std::string r;
      for (const std::int32_t step : {i * 100, i * i, 7}) put(r, step);
      r.resize(20);
      for (int c = 0; c < 3; ++c) put(r, static_cast<std::uint16_t>(brightest * i / 9));
      las.records.push_back(r + extra);
    }
    return folder_.write(name, las.build());
  }
  Outcome build_two(const std::vector<std::string>& a, const std::vector<std::string>& b,
                    std::vector<std::string> flags = {}) {
    flags.insert(flags.begin(), {las("a.las", a), las("b.las", b), "--force"});
    return build(flags);
  }
  std::string refusal(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    const Outcome outcome = build_two(a, b);
    expect_refusal(outcome, 3);
    return outcome.err;
  }
};

TEST_F(ScanFacts, ScansOfDifferentSystemsAreRefusedUnlessTold) {
  const auto utm10 = geo_keys({{1024, 1}, {3072, 26910}, {3076, 9001}});
  const auto utm11 = geo_keys({{1024, 1}, {3072, 26911}, {3076, 9001}});
  EXPECT_THAT(refusal({utm10}, {utm11}),
              HasSubstr("the coordinate system of b.las is not that of the scans before"));
  EXPECT_THAT(refusal({utm10}, {utm11}), HasSubstr("EPSG:26911"));
  EXPECT_THAT(refusal({utm10}, {utm11}), HasSubstr("EPSG:26910, as a.las has it"));
  EXPECT_EQ(build_two({utm10}, {utm11}, {"--mixed-crs"}).exit_code, 0);
  const std::string back = folder_ / "back.las";
  EXPECT_EQ(cairn({"export", "--progress", "none", output(), "-o", back}).exit_code, 0);
  // One directory of keys, that of the first.
  const std::string bytes = read_text(back);
  EXPECT_EQ(get_at<std::uint32_t>(bytes, 100), 1U);
  EXPECT_EQ(bytes.substr(227 + 54, utm10.size() - 54), utm10.substr(54));
  EXPECT_EQ(build_two({utm10}, {utm11}, {"--crs", "EPSG:26911"}).exit_code, 0);
  EXPECT_EQ(info().at("crs").at("epsg"), 26911);
}

TEST_F(ScanFacts, ContradictionsAreFoundInAnyOrder) {
  const std::string site = "LOCAL_CS[\"our site\",UNIT[\"metre\",1]]";
  const auto code = [](int n) { return geo_keys({{1024, 1}, {3072, n}}); };
  // A code that nobody has tells no unit.
  const auto in_feet = geo_keys({{1024, 1}, {3072, 65000}, {3076, 9002}}),
             in_metres = geo_keys({{1024, 1}, {3072, 65000}, {3076, 9001}});
  // The first of each agrees with both others, as far as can be told.
  const std::vector<std::array<std::string, 3>> triples{
      {vlr_bytes("LASF_Projection", 2112, site + '\0'), code(26910), code(26911)},
      {code(65000), in_feet, in_metres}};
  for (const auto& triple : triples) {
    std::vector<int> order{0, 1, 2};
    do {
      std::vector<std::string> files;
      for (const int i : order)
        files.push_back(las("scan" + std::to_string(files.size()) + ".las",
                            {triple[static_cast<std::size_t>(i)]}));
      const Outcome outcome = build({files[0], files[1], files[2], "--force"});
      expect_refusal(outcome, 3);
      EXPECT_THAT(outcome.err, HasSubstr("is not that of the scans before"));
      const bool agreeing_last = order[2] == 0;
      EXPECT_THAT(outcome.err, HasSubstr(agreeing_last ? "of scan1.las is" : "of scan2.las is"));
    } while (std::ranges::next_permutation(order).found);
  }
}

TEST_F(ScanFacts, FeetAreNotSurveyFeetNorHeightsInMetres) {
  const std::pair<int, int> model{1024, 1}, code{3072, 2994};
  EXPECT_THAT(
      refusal({geo_keys({model, code, {3076, 9002}})}, {geo_keys({model, code, {3076, 9003}})}),
      HasSubstr("the unit of length of b.las is not that of the scans before"));
  EXPECT_THAT(
      refusal({geo_keys({model, code, {4099, 9002}})}, {geo_keys({model, code, {4099, 9001}})}),
      HasSubstr("found metre, expected foot"));
}

TEST_F(ScanFacts, TheSameSystemInOtherWordsIsTaken) {
  const std::string wkt =
      "PROJCS[\"any name\", UNIT[\"foot\",0.3048],AUTHORITY[\"EPSG\",\"2994\"]]";
  const Outcome outcome = build_two({geo_keys({{1024, 1}, {3072, 2994}, {3076, 9002}})},
                                    {vlr_bytes("LASF_Projection", 2112, wkt + '\0')});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const Json crs = info().at("crs");
  EXPECT_EQ(crs.at("epsg"), 2994);
  EXPECT_EQ(crs.at("unit_metres"), 0.3048);
  EXPECT_EQ(crs.at("wkt"), wkt);
  EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("in units of a foot"));
}

TEST_F(ScanFacts, AScanWithoutASystemIsTold) {
  const Outcome outcome = build_two({}, {geo_keys({{1024, 1}, {3072, 2994}})});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err,
              HasSubstr("cairn: note: a.las tells no coordinate system; the coordinates "
                        "are taken to be in that of b.las, EPSG:2994"));
  EXPECT_EQ(build_two({}, {}).err, "");
  // An empty record is none.
  const std::string empty = vlr_bytes("LASF_Projection", 2112, std::string(1, '\0'));
  EXPECT_THAT(build_two({empty}, {geo_keys({{1024, 1}, {3072, 2994}})}).err,
              HasSubstr("a.las tells no coordinate system"));
}

TEST_F(ScanFacts, SystemsThatCannotBeComparedAreTold) {
  const auto build_beside_feet = [&](const std::string& unit) {
    const std::string wkt = "LOCAL_CS[\"our site\",UNIT[" + unit + "]]";
    return build_two({geo_keys({{1024, 1}, {3072, 2994}})},
                     {vlr_bytes("LASF_Projection", 2112, wkt + '\0')});
  };
  const Outcome metres = build_beside_feet("\"metre\",1");
  EXPECT_EQ(metres.exit_code, 3);
  EXPECT_THAT(metres.err, HasSubstr("found metre, expected foot, as a.las has it"));
  const Outcome outcome = build_beside_feet("\"foot\",0.3048");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("our site, is taken for that of a.las, EPSG:2994"));
}

TEST_F(ScanFacts, ColorsOf8BitsIn16AreSaidAndKept) {
  const std::string dark = las("dark.las", {}, 255), other = las("other.las", {}, 200);
  const Outcome built = build({dark, other, "--lossless-leaves"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_EQ(built.err, "");
  const auto color_of = [](const Json& told) {
    for (const Json& attribute : told.at("schema"))
      if (attribute.at("name") == "color") return attribute;
    return Json();
  };
  EXPECT_EQ(color_of(info()).at("bits"), 8);
  EXPECT_EQ(color_of(info()).at("type"), "uint16");
  EXPECT_THAT(built.out, HasSubstr("color uint16 x 3 of 8 bits"));
  EXPECT_THAT(cairn({"info", output()}).out, HasSubstr("of 8 bits"));
  EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("colors: of 8 bits in fields of 16"));
  EXPECT_EQ(cairn({"verify", "--progress", "none", output(), "--against", dark, other}).exit_code,
            0);
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", folder_ / "back.las"}).exit_code,
            0);
  std::uint16_t brightest = 0;
  for (const LasPoint& point : read_las(folder_ / "back.las").points)
    brightest = std::max(brightest, point.colors[0]);
  EXPECT_EQ(brightest, 255);
}

TEST_F(ScanFacts, DarkScansAmongOthersAreToldAndBlackOnesAreNot) {
  const std::string dark = las("dark.las", {}, 255);
  const Outcome mixed = build({dark, las("bright.las", {}, 65535)});
  EXPECT_THAT(mixed.err, HasSubstr("no color of dark.las is above 255"));
  EXPECT_THAT(mixed.out, Not(HasSubstr("of 8 bits")));
  const Outcome black = build({las("black.las", {}, 0), "--force"});
  EXPECT_EQ(black.err, "");
  EXPECT_THAT(black.out, Not(HasSubstr("of 8 bits")));
  const Outcome dropped = build({dark, "--drop", "color", "--force"});
  EXPECT_EQ(dropped.err, "");
  EXPECT_THAT(dropped.out, Not(HasSubstr("of 8 bits")));
}

TEST_F(ScanFacts, IntensitiesOfOtherRangesAreTold) {
  const auto scan = [](const E57Stream& intensity, const std::string& most) {
    E57ScanBytes made{.streams = e57_line(3),
                      .xml =
                          "<intensityLimits type=\"Structure\"><intensityMinimum type=\"Float\"/>"
                          "<intensityMaximum type=\"Float\">" +
                          most + "</intensityMaximum></intensityLimits>"};
    made.streams.push_back(intensity);
    return made;
  };
  const auto real = scan(e57_floats("intensity", {0, 0.5F, 1}), "1"),
             whole = scan(e57_integers("intensity", 0, 2047, {0, 9, 2047}), "2047"),
             held = scan(e57_integers("intensity", 0, 2047, {0, 9, 1980}), "1980");
  const auto build_of = [&](const std::vector<E57ScanBytes>& scans,
                            const std::vector<std::string>& flags) {
    std::vector<std::string> arguments{folder_.write("site.e57", E57Bytes{.scans = scans}.bytes()),
                                       "--force"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const Outcome outcome = build(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(
      build_of({real, whole, held}, {}),
      HasSubstr("cairn: note: intensities of site.e57, scan 2 and site.e57, scan 3 go from 0 to "
                "2047, those of site.e57, scan 1 from 0 to 1: values are kept as they are "
                "stored"));
  EXPECT_EQ(build_of({whole, held}, {}), "");
  EXPECT_EQ(build_of({real, whole}, {"--drop", "intensity"}), "");
}

TEST_F(ScanFacts, ExtraBytesOfOtherScalesAreTold) {
  const auto scaled = [](double scale) {
    std::string entry = extra_bytes_entry("Depth", 3, 8);
    put_at(entry, 112, scale);
    return vlr_bytes("LASF_Spec", 4, entry);
  };
  const std::string two(2, '\7');
  const std::string a = las("a.las", {scaled(0.01)}, 65535, two),
                    b = las("b.las", {scaled(0.5)}, 65535, two);
  const Outcome mixed = build({a, b});
  ASSERT_EQ(mixed.exit_code, 0) << mixed.err;
  EXPECT_THAT(mixed.err,
              HasSubstr("depth has another scale, offset or no-data value in b.las than in a.las"));
  EXPECT_THAT(info().at("schema").dump(), Not(HasSubstr("\"scale\"")));
  const Outcome same = build({a, "--force"});
  EXPECT_EQ(same.err, "");
  EXPECT_THAT(info().at("schema").dump(), HasSubstr("\"scale\":0.01"));
}

TEST_F(ScanFacts, AutzensColorsAreOf8Bits) {
  CAIRN_NEEDS_SHARED_DATA();
  ASSERT_EQ(build({CAIRN_SHARED_DATA "/las/autzen_trim.las", "--reducer", "first"}).exit_code, 0);
  const LasFile scan = read_las(CAIRN_SHARED_DATA "/las/autzen_trim.las");
  std::uint16_t brightest = 0;
  for (const LasPoint& point : scan.points)
    for (std::size_t c = 0; c < 3; ++c) brightest = std::max(brightest, point.colors[c]);
  EXPECT_EQ(info().at("schema").dump().find("\"bits\":8") != std::string::npos, brightest <= 255);
}

}  // namespace
}  // namespace cairn::test
