// Records of coordinate reference systems: GeoTIFF 1.1 keys and OGC WKT as the LAS specification asks for.
#include "formats/scans/crs.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace cairn::formats {
namespace {

std::vector<std::uint16_t> keys_of(const std::string& text) {
  const auto records = crs_records(text).value();
  EXPECT_EQ(records.size(), 1U);
  EXPECT_EQ(records.front().user_id, "LASF_Projection");
  EXPECT_EQ(records.front().record_id, 34735);
  std::vector<std::uint16_t> keys(records.front().data.size() / 2);
  std::memcpy(keys.data(), records.front().data.data(), 2 * keys.size());
  return keys;
}

TEST(Crs, EpsgCodesBecomeGeoTiffKeys) {
  // Directory 1.1.1 of two keys: the model (1024) is projected (1), its code (3072) this one.
  EXPECT_EQ(keys_of("EPSG:32633"),
            (std::vector<std::uint16_t>{1, 1, 1, 2, 1024, 0, 1, 1, 3072, 0, 1, 32633}));
  // Geographic (2), by the geographic code (2048).
  EXPECT_EQ(keys_of("EPSG:4326"),
            (std::vector<std::uint16_t>{1, 1, 1, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326}));
}

// By the EPSG registry (epsg.org), whose numbers follow no rule.
TEST(Crs, TheRegistryTellsWhatIsGeographic) {
  for (const char* text : {"EPSG:4647", "EPSG:32633", "EPSG:2056", "EPSG:4087", "EPSG:25832",
                           "EPSG:3857", "EPSG:7856", "EPSG:31468"}) {
    EXPECT_EQ(keys_of(text).at(7), 1) << text;
    EXPECT_EQ(keys_of(text).at(8), 3072) << text;
  }
  for (const char* text : {"EPSG:4326", "EPSG:4258", "EPSG:7844", "EPSG:6318", "EPSG:9057"}) {
    EXPECT_EQ(keys_of(text).at(7), 2) << text;
    EXPECT_EQ(keys_of(text).at(8), 2048) << text;
  }
  // Compound, vertical, geocentric, of three dimensions: none of these keys tells them.
  for (const char* text : {"EPSG:7415", "EPSG:5703", "EPSG:4978", "EPSG:4979"})
    EXPECT_FALSE(crs_records(text)) << text;
}

TEST(Crs, WktIsKeptWithAZeroBehindIt) {
  const std::string wkt = "PROJCS[\"UTM\",GEOGCS[]]";
  const auto records = crs_records(wkt).value();
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records.front().user_id, "LASF_Projection");
  EXPECT_EQ(records.front().record_id, 2112);
  ASSERT_EQ(records.front().data.size(), wkt.size() + 1);
  EXPECT_EQ(std::memcmp(records.front().data.data(), wkt.c_str(), wkt.size() + 1), 0);
}

TEST(Crs, TheNameIsThatOfTheWktOrTheCode) {
  EXPECT_EQ(crs_name({}), "");
  for (const char* text : {"EPSG:32633", "EPSG:4326"})
    EXPECT_EQ(crs_name(*crs_records(text)), text);
  EXPECT_EQ(crs_name(*crs_records("PROJCS[\"UTM 33\",GEOGCS[\"WGS\"]]")), "UTM 33");
  EXPECT_EQ(crs_name(*crs_records("PROJCS[\"UTM")), "unnamed");
  // 32767 is a system that the keys describe instead of naming it; a directory may be cut short.
  auto keys = crs_records("EPSG:32633").value();
  keys[0].data[22] = std::byte{0xff}, keys[0].data[23] = std::byte{0x7f};
  EXPECT_EQ(crs_name(keys), "unnamed");
  for (std::size_t size = 0; size < 24; ++size) {
    keys[0].data.resize(size);
    EXPECT_EQ(crs_name(keys), "unnamed");
  }
}

TEST(Crs, AnythingElseIsNone) {
  for (const char* text : {"", "EPSG:", "EPSG:12", "EPSG:32767", "EPSG:99999", "EPSG:4326 ",
                           "EPSG:-4326", "epsg", "4326", "UTM 33", "PROJCS"})
    EXPECT_FALSE(crs_records(text)) << text;
}

}  // namespace
}  // namespace cairn::formats
