// What records of coordinate systems tell, and when two are the same. Numbers are those of the EPSG registry.
#include "formats/scans/crs_facts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "formats/scans/crs.h"
#include "formats/scans/wkt.h"

namespace cairn::formats {
namespace {

using Records = std::vector<VariableLengthRecord>;

Records wkt(const std::string& text) {
  VariableLengthRecord record{.user_id = "LASF_Projection", .record_id = 2112};
  for (const char c : text + std::string(1, '\0')) record.data.push_back(static_cast<std::byte>(c));
  return {record};
}

/// GeoTIFF keys, each with its value in place.
Records keys(const std::vector<std::pair<std::uint16_t, std::uint16_t>>& values) {
  std::vector<std::uint16_t> words{1, 1, 0, static_cast<std::uint16_t>(values.size())};
  for (const auto& [key, value] : values) words.insert(words.end(), {key, 0, 1, value});
  VariableLengthRecord record{.user_id = "LASF_Projection", .record_id = 34735};
  record.data.resize(2 * words.size());
  std::memcpy(record.data.data(), words.data(), record.data.size());
  return {record};
}

/// The same, and a unit of this many metres (key 3077).
Records keys_with_unit(double metres, std::vector<std::pair<std::uint16_t, std::uint16_t>> values) {
  values.emplace_back(3077, 0);
  Records records = keys(values);
  // Where the last key's value stands: among the doubles.
  const std::uint16_t place = 34736;
  std::memcpy(records[0].data.data() + records[0].data.size() - 6, &place, sizeof place);
  VariableLengthRecord doubles{.user_id = "LASF_Projection", .record_id = 34736};
  doubles.data.resize(sizeof metres);
  std::memcpy(doubles.data.data(), &metres, sizeof metres);
  records.push_back(doubles);
  return records;
}

std::string utm(int zone, const std::string& unit, const std::string& code,
                const std::string& name = "NAD83 / UTM") {
  return "PROJCS[\"" + name +
         "\", GEOGCS[\"NAD83\",DATUM[\"North_American_Datum_1983\","
         "SPHEROID[\"GRS 1980\",6378137,298.257222101,AUTHORITY[\"EPSG\",\"7019\"]]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4269\"]]"
         ","
         "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",0],"
         "PARAMETER[\"central_meridian\"," +
         std::to_string(6 * zone - 183) +
         "],"
         "PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000]," +
         unit + (code.empty() ? "" : ",AUTHORITY[\"EPSG\",\"" + code + "\"]") + "]";
}
const std::string kMetre = "UNIT[\"metre\",1]";

TEST(Wkt, IsATreeOfKeywordsTextsAndNumbers) {
  const auto node =
      parse_wkt(" ProjCS [ \"a \"\"b\"\", c\" , UNIT(\"metre\", 1.0e0), AXIS[\"X\",EAST] ] ");
  ASSERT_TRUE(node);
  EXPECT_EQ(node->keyword, "PROJCS");
  EXPECT_EQ(node->texts, std::vector<std::string>{"a \"b\", c"});
  ASSERT_EQ(node->children.size(), 2U);
  EXPECT_EQ(node->children[0].numbers, std::vector<double>{1});
  EXPECT_EQ(node->children[1].texts, (std::vector<std::string>{"X", "EAST"}));
}

TEST(Wkt, RefusesWhatIsNone) {
  std::string deep;
  for (int i = 0; i < 40; ++i) deep += "A[";
  deep += "1" + std::string(40, ']');
  for (const std::string& text :
       {std::string(), std::string("PROJCS"), std::string("PROJCS[\"a"), std::string("PROJCS[1,]"),
        std::string("PROJCS[1]]"), std::string("PROJCS[]"), std::string("[1]"), deep,
        "A[" + std::string(1 << 20, ' ') + "1]"})
    EXPECT_FALSE(parse_wkt(text)) << text.substr(0, 40);
}

TEST(CrsFacts, OfWktOne) {
  const CrsFacts facts =
      crs_facts(wkt("COMPD_CS[\"both\"," + utm(10, kMetre, "26910") +
                    ",VERT_CS[\"NAVD88 height (ftUS)\",VERT_DATUM[\"NAVD 88\",2005],"
                    "UNIT[\"US survey foot\",0.304800609601219],AUTHORITY[\"EPSG\",\"6360\"]]]"));
  EXPECT_EQ(facts.name, "both");
  EXPECT_EQ(facts.kind, CrsKind::kProjected);
  EXPECT_EQ(facts.code, 26910U);
  EXPECT_EQ(facts.vertical_code, 6360U);
  EXPECT_EQ(facts.unit_m, 1);
  EXPECT_EQ(unit_name(facts.vertical_unit_m.value()), "US survey foot");
  EXPECT_EQ(facts.numbers.at("central_meridian"), -123);
  EXPECT_EQ(facts.numbers.at("inverse_flattening"), 298.257222101);
}

TEST(CrsFacts, OfTwoSystemsInARow) {
  const CrsFacts facts =
      crs_facts(wkt(utm(10, kMetre, "") +
                    ",VERTCS[\"NAVD_1988\",VDATUM[\"North_American\"],"
                    "PARAMETER[\"Vertical_Shift\",0.0],UNIT[\"Foot_US\",0.3048006096012192]]"));
  EXPECT_EQ(facts.kind, CrsKind::kProjected);
  EXPECT_EQ(facts.unit_m, 1);
  EXPECT_EQ(unit_name(facts.vertical_unit_m.value()), "US survey foot");
}

TEST(CrsFacts, OfASiteOfItsOwnUnitsAreTold) {
  const std::string site = "LOCAL_CS[\"site\",UNIT[\"foot\",0.3048]]";
  const CrsFacts facts = crs_facts(wkt(site));
  EXPECT_FALSE(facts.kind);
  EXPECT_EQ(facts.unit_m, 0.3048);
  EXPECT_FALSE(facts.vertical_unit_m);
  const std::string heights = "VERT_CS[\"h\",VERT_DATUM[\"d\",2005],UNIT[\"metre\",1]]";
  for (const std::string& both : {site + "," + heights, heights + "," + site}) {
    const CrsFacts compound = crs_facts(wkt("COMPD_CS[\"x\"," + both + "]"));
    EXPECT_EQ(compound.unit_m, 0.3048);
    EXPECT_EQ(compound.vertical_unit_m, 1);
  }
}

TEST(CrsFacts, HeightsMayBeBoundOrTheThirdAxis) {
  const CrsFacts bound = crs_facts(
      wkt("COMPOUNDCRS[\"x\",PROJCRS[\"p\",CS[Cartesian,2],AXIS[\"E\",east],AXIS[\"N\",north],"
          "LENGTHUNIT[\"metre\",1]],BOUNDCRS[SOURCECRS[VERTCRS[\"NAVD88 height (ftUS)\","
          "VDATUM[\"NAVD 88\"],CS[vertical,1],AXIS[\"up\",up,LENGTHUNIT[\"US survey foot\","
          "0.304800609601219]],ID[\"EPSG\",6360]]],TARGETCRS[GEOGCRS[\"g\"]]]]"));
  EXPECT_EQ(bound.unit_m, 1);
  EXPECT_EQ(bound.vertical_code, 6360U);
  EXPECT_EQ(unit_name(bound.vertical_unit_m.value()), "US survey foot");
  const CrsFacts axes = crs_facts(
      wkt("PROJCRS[\"p\",CS[Cartesian,3],AXIS[\"E\",east,LENGTHUNIT[\"foot\",0.3048]],"
          "AXIS[\"N\",north,LENGTHUNIT[\"foot\",0.3048]],AXIS[\"h\",up,LENGTHUNIT[\"metre\",1]]]"));
  EXPECT_EQ(axes.unit_m, 0.3048);
  EXPECT_EQ(axes.vertical_unit_m, 1);
}

/// EGM2008 height is EPSG:3855, in metres; 5103 is GeoTIFF 1.0's own NAVD88.
TEST(CrsFacts, HeightsOfLowCodesAreKnownThoseOfOldGeoTiffAreNot) {
  const CrsFacts facts = crs_facts(keys({{1024, 1}, {3072, 2264}, {4096, 3855}}));
  EXPECT_EQ(unit_name(facts.unit_m.value()), "US survey foot");
  EXPECT_EQ(facts.vertical_code, 3855U);
  EXPECT_EQ(facts.vertical_unit_m, 1);
  for (const std::uint16_t old : {5001, 5103, 5106})
    EXPECT_FALSE(crs_facts(keys({{1024, 1}, {3072, 2264}, {4096, old}})).vertical_code) << old;
}

TEST(CrsFacts, CodesTellUnitsThatNothingElseDoes) {
  const CrsFacts feet = crs_facts(keys({{1024, 1}, {3072, 2264}, {4096, 6360}}));
  EXPECT_EQ(feet.unit_m, 1200.0 / 3937);
  EXPECT_EQ(feet.vertical_unit_m, 1200.0 / 3937);
  EXPECT_EQ(crs_facts(keys({{1024, 1}, {3072, 2264}, {3076, 9001}})).unit_m, 1);
  EXPECT_EQ(crs_facts(keys({{1024, 2}, {2048, 4326}})).unit_m, std::nullopt);
}

TEST(CrsFacts, OfWktTwo) {
  const CrsFacts facts = crs_facts(
      wkt("PROJCRS[\"WGS 84 / UTM zone 33N\",BASEGEOGCRS[\"WGS 84\",DATUM[\"World Geodetic System "
          "1984\","
          "ELLIPSOID[\"WGS 84\",6378137,298.257223563,LENGTHUNIT[\"metre\",1]]]],"
          "CONVERSION[\"UTM zone 33N\",METHOD[\"Transverse Mercator\"],"
          "PARAMETER[\"Longitude of natural origin\",15,ANGLEUNIT[\"degree\",0.0174532925199433]]],"
          "CS[Cartesian,2],AXIS[\"easting\",east,ORDER[1],LENGTHUNIT[\"foot\",0.3048]],"
          "AXIS[\"northing\",north,ORDER[2],LENGTHUNIT[\"foot\",0.3048]],ID[\"EPSG\",32633]]"));
  EXPECT_EQ(facts.code, 32633U);
  EXPECT_EQ(unit_name(facts.unit_m.value()), "foot");
  EXPECT_EQ(facts.numbers.at("longitude_of_natural_origin"), 15);
}

TEST(CrsFacts, OfGeoTiffKeys) {
  const CrsFacts facts =
      crs_facts(keys({{1024, 1}, {3072, 2994}, {3076, 9002}, {4096, 5703}, {4099, 9003}}));
  EXPECT_EQ(facts.code, 2994U);
  EXPECT_EQ(facts.vertical_code, 5703U);
  EXPECT_EQ(unit_name(facts.unit_m.value()), "foot");
  EXPECT_EQ(unit_name(facts.vertical_unit_m.value()), "US survey foot");
  EXPECT_EQ(crs_facts(keys({{1024, 2}, {2048, 4326}})).kind, CrsKind::kGeographic);
  EXPECT_EQ(crs_facts(keys({{1024, 2}, {2048, 4326}})).code, 4326U);
  EXPECT_EQ(crs_facts(keys({{1024, 1}, {3072, 32767}})).code, std::nullopt);
}

TEST(CrsFacts, OfWktTwoInLongForm) {
  // Keywords of ISO 19162:2019, section 6: each of these systems has a short one and a long one.
  const std::string rest =
      "[\"a\",BASEGEOGCRS[\"WGS 84\",DATUM[\"d\",ELLIPSOID[\"WGS 84\",6378137,298.257223563]]],"
      "CONVERSION[\"c\",METHOD[\"m\"],PARAMETER[\"Longitude of natural origin\",15]],"
      "CS[Cartesian,2],LENGTHUNIT[\"foot\",0.3048],ID[\"EPSG\",32633]]";
  for (const char* keyword : {"PROJCRS", "PROJECTEDCRS"}) {
    const CrsFacts facts = crs_facts(wkt(keyword + rest));
    EXPECT_EQ(facts.kind, CrsKind::kProjected) << keyword;
    EXPECT_EQ(facts.code, 32633U) << keyword;
    EXPECT_EQ(facts.unit_m, 0.3048) << keyword;
    EXPECT_TRUE(crs_records(keyword + rest)) << keyword;
  }
  const std::string datum = "[\"a\",DATUM[\"d\",ELLIPSOID[\"e\",6378137,298.257223563]],CS[";
  for (const char* keyword : {"GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"}) {
    const CrsFacts facts = crs_facts(wkt(keyword + datum + "ellipsoidal,2],ID[\"EPSG\",4326]]"));
    EXPECT_EQ(facts.kind, CrsKind::kGeographic) << keyword;
    EXPECT_EQ(facts.code, 4326U) << keyword;
  }
  for (const char* keyword : {"VERTCRS", "VERTICALCRS"}) {
    const CrsFacts facts =
        crs_facts(wkt("COMPOUNDCRS[\"both\",PROJECTEDCRS" + rest + "," + keyword +
                      "[\"h\",LENGTHUNIT[\"metre\",1],ID[\"EPSG\",5773]]]"));
    EXPECT_EQ(facts.code, 32633U) << keyword;
    EXPECT_EQ(facts.vertical_code, 5773U) << keyword;
    EXPECT_FALSE(crs_records(std::string(keyword) + "[\"h\"]")) << keyword;
  }
  for (const char* keyword : {"ENGCRS", "ENGINEERINGCRS", "BOUNDCRS"})
    EXPECT_TRUE(crs_records(std::string(keyword) + "[\"a\"]")) << keyword;
}

TEST(CrsFacts, GeocentricSystemsAreNotGeographic) {
  const std::string earth =
      "[\"a\",DATUM[\"d\",ELLIPSOID[\"e\",6378137,298.257223563]],"
      "CS[Cartesian,3],LENGTHUNIT[\"metre\",1],ID[\"EPSG\",4978]]";
  for (const char* keyword : {"GEODCRS", "GEODETICCRS"}) {
    const CrsFacts facts = crs_facts(wkt(keyword + earth));
    EXPECT_EQ(facts.kind, CrsKind::kGeocentric) << keyword;
    EXPECT_EQ(facts.code, 4978U) << keyword;
    EXPECT_EQ(facts.unit_m, 1) << keyword;
  }
  EXPECT_EQ(crs_facts(wkt("GEOCCS[\"a\",UNIT[\"metre\",1]]")).kind, CrsKind::kGeocentric);
  const CrsFacts told = crs_facts(keys({{1024, 3}, {2048, 4978}}));
  EXPECT_EQ(told.kind, CrsKind::kGeocentric);
  EXPECT_EQ(told.code, 4978U);
}

TEST(CrsFacts, UndefinedAndUserDefinedKeysTellNothing) {
  // GeoTIFF 1.1, section 7.1: 0 is undefined, 32767 is told by other keys.
  for (const std::uint16_t none : {std::uint16_t{0}, std::uint16_t{32767}}) {
    const CrsFacts facts = crs_facts(keys({{1024, none},
                                           {2048, none},
                                           {2050, none},
                                           {2056, none},
                                           {3072, none},
                                           {3074, none},
                                           {3075, none},
                                           {3076, none},
                                           {4096, none},
                                           {4099, none}}));
    EXPECT_EQ(facts.kind, std::nullopt) << none;
    EXPECT_EQ(facts.code, std::nullopt) << none;
    EXPECT_EQ(facts.vertical_code, std::nullopt) << none;
    EXPECT_EQ(facts.unit_m, std::nullopt) << none;
    EXPECT_TRUE(facts.numbers.empty()) << none;
    EXPECT_EQ(facts.name, "unnamed") << none;
  }
}

TEST(CrsFacts, UnitsAreLengths) {
  for (const double size : {0.0, -1.0, HUGE_VAL, -HUGE_VAL, std::nan("")})
    EXPECT_EQ(crs_facts(keys_with_unit(size, {{1024, 1}})).unit_m, std::nullopt) << size;
  EXPECT_EQ(crs_facts(keys_with_unit(0.9144, {{1024, 1}})).unit_m, 0.9144);
  EXPECT_EQ(crs_facts(wkt("PROJCS[\"a\",UNIT[\"b\",inf]]")).unit_m, std::nullopt);
}

TEST(CrsFacts, DamagedRecordsTellNothing) {
  Records broken = keys({{3072, 2994}});
  broken[0].data.resize(13);
  EXPECT_EQ(crs_facts(broken).code, std::nullopt);
  EXPECT_EQ(crs_facts(wkt("PROJCS[\"a\",UNIT[\"b\",1]")).unit_m, std::nullopt);
  EXPECT_EQ(crs_facts({}).name, "");
}

CrsMatch match(const Records& a, const Records& b) {
  EXPECT_EQ(compare_crs(a, b).match, compare_crs(b, a).match);
  return compare_crs(a, b).match;
}

TEST(CompareCrs, NamesAndWhiteSpaceDoNotCount) {
  EXPECT_EQ(
      match(wkt(utm(10, kMetre, "")), wkt(utm(10, "UNIT[\"Meter\", 1.0]", "", "NAD_1983_UTM_10N"))),
      CrsMatch::kSame);
  EXPECT_EQ(match(wkt(utm(10, kMetre, "26910")), keys({{1024, 1}, {3072, 26910}, {3076, 9001}})),
            CrsMatch::kSame);
  EXPECT_EQ(match(crs_records("EPSG:26910").value(), wkt(utm(10, kMetre, "26910"))),
            CrsMatch::kSame);
  EXPECT_EQ(match({}, {}), CrsMatch::kSame);
}

TEST(CompareCrs, ZonesCodesEllipsoidsAndDegreesDo) {
  EXPECT_EQ(match(wkt(utm(10, kMetre, "")), wkt(utm(11, kMetre, ""))), CrsMatch::kDifferent);
  EXPECT_EQ(match(keys({{3072, 26910}}), keys({{3072, 26911}})), CrsMatch::kDifferent);
  std::string other = utm(10, kMetre, "");
  other.replace(other.find("298.257222101"), 13, "298.257223563");
  EXPECT_EQ(match(wkt(utm(10, kMetre, "")), wkt(other)), CrsMatch::kDifferent);
  EXPECT_EQ(match(keys({{1024, 2}, {2048, 4326}}), keys({{1024, 1}, {3072, 32633}})),
            CrsMatch::kDifferent);
  EXPECT_EQ(match(keys({{3072, 2994}, {4096, 5703}}), keys({{3072, 2994}, {4096, 6360}})),
            CrsMatch::kDifferent);
}

TEST(CompareCrs, UnitsDoAndAreNamed) {
  const CrsComparison feet =
      compare_crs(keys({{3072, 2994}, {3076, 9002}}), keys({{3072, 2994}, {3076, 9003}}));
  EXPECT_EQ(feet.match, CrsMatch::kDifferent);
  EXPECT_EQ(feet.what, "unit of length");
  EXPECT_EQ(feet.first, "foot");
  EXPECT_EQ(feet.second, "US survey foot");
  EXPECT_EQ(
      compare_crs(keys({{3072, 2994}, {4099, 9001}}), keys({{3072, 2994}, {4099, 9002}})).what,
      "unit of height");
}

TEST(CompareCrs, UserDefinedKeysAreHeldAgainstWhatTheyTell) {
  // A projection of one's own, told by 32767 and parameters in one file, by its code in the other.
  EXPECT_EQ(match(keys({{1024, 1}, {3072, 32767}, {3074, 32767}, {3075, 1}}),
                  keys({{1024, 1}, {3072, 0}, {3074, 16010}, {3075, 1}})),
            CrsMatch::kUnknown);
  EXPECT_EQ(match(keys({{1024, 1}, {3072, 32767}, {3075, 1}}),
                  keys({{1024, 1}, {3072, 32767}, {3075, 8}})),
            CrsMatch::kDifferent);
  // The same unit, as a code and as a size.
  EXPECT_EQ(match(keys_with_unit(0.3048, {{1024, 1}, {3075, 1}, {3076, 32767}}),
                  keys({{1024, 1}, {3075, 1}, {3076, 9002}})),
            CrsMatch::kSame);
}

TEST(CompareCrs, WhatTellsTooLittleIsUnknown) {
  EXPECT_EQ(match(keys({{3072, 2994}}), wkt("LOCAL_CS[\"site\",UNIT[\"foot\",0.3048]]")),
            CrsMatch::kUnknown);
  EXPECT_EQ(match(keys({{3072, 2994}}), wkt("LOCAL_CS[\"site\",UNIT[\"metre\",1]]")),
            CrsMatch::kDifferent)
      << "feet";
  EXPECT_EQ(match(keys({{3072, 26910}}), wkt(utm(10, kMetre, ""))), CrsMatch::kUnknown);
}

TEST(CrsText, IsTakenBackAndKeepsToOneLine) {
  for (const std::string text : {"EPSG:2994", "EPSG:4326", "PROJCS[\"a\",UNIT[\"metre\",1]]"}) {
    const Records records = crs_records(text).value();
    EXPECT_EQ(crs_text(records), text);
    EXPECT_EQ(crs_of_comment("crs " + crs_text(records)), records);
  }
  EXPECT_EQ(crs_text(wkt("PROJCS[\"a\",\n  UNIT[\"metre\",1]]")),
            "PROJCS[\"a\",   UNIT[\"metre\",1]]");
  EXPECT_EQ(crs_text({}), "");
  EXPECT_EQ(crs_text(wkt("PROJCS[\"" + std::string(40'000, 'a') + "\"]")), "");
  EXPECT_TRUE(crs_of_comment("crs").empty());
  EXPECT_TRUE(crs_of_comment("crs nothing known").empty());
  EXPECT_TRUE(crs_of_comment("created by EPSG:2994").empty());
}

}  // namespace
}  // namespace cairn::formats
