// Units of systems that a code names, against what the EPSG registry says of some (epsg.org).
#include "formats/scans/epsg_unit.h"

#include <gtest/gtest.h>

namespace cairn::formats {
namespace {

constexpr double kFoot = 0.3048, kUsSurveyFoot = 1200.0 / 3937;

TEST(EpsgUnit, OfProjectedSystems) {
  for (const std::uint16_t code : {26910, 32632, 27700, 2056, 25832, 3857, 2949, 31370})
    EXPECT_EQ(epsg_unit_m(code), 1) << code;
  // North Carolina, Texas Central, California zone 1, Florida East, Colorado North.
  for (const std::uint16_t code : {2264, 2277, 2225, 2236, 2231})
    EXPECT_EQ(epsg_unit_m(code), kUsSurveyFoot) << code;
  // Oregon GIC Lambert, Arizona East, Michigan Central.
  for (const std::uint16_t code : {2992, 2994, 2222, 2252})
    EXPECT_EQ(epsg_unit_m(code), kFoot) << code;
  EXPECT_EQ(epsg_unit_m(29381), 1.0000135965);    // Schwarzeck, German legal metre
  EXPECT_EQ(epsg_unit_m(30200), 0.201166195164);  // Trinidad 1903, Clarke's link
  for (const std::uint16_t code : {0, 4326, 4978, 5703, 65535})
    EXPECT_FALSE(epsg_unit_m(code)) << code;
}

TEST(EpsgUnit, OfHeights) {
  for (const std::uint16_t code : {5703, 5701, 5773, 7837})
    EXPECT_EQ(epsg_height_unit_m(code), 1) << code;
  EXPECT_EQ(epsg_height_unit_m(6360), kUsSurveyFoot);  // NAVD88
  EXPECT_EQ(epsg_height_unit_m(8228), kFoot);          // NAVD88
  for (const std::uint16_t code : {0, 2264, 4326}) EXPECT_FALSE(epsg_height_unit_m(code)) << code;
}

}  // namespace
}  // namespace cairn::formats
