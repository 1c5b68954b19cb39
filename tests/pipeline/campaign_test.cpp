// Scans opened together, and the poses that belong to each.
#include "pipeline/campaign.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "formats/error.h"
#include "tests/support/laz_bytes.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader = "scan tx ty tz qw qx qy qz\n";

class Campaigns : public ::testing::Test {
 protected:
  /// The message of the refusal.
  static std::string refusal(const CampaignOptions& options, formats::ErrorKind kind) {
    try {
      open_campaign(options);
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), kind) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  /// A file of two scans of one cell each.
  std::filesystem::path two_ptx() const {
    const std::string scan =
        "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.5\n";
    return folder_.write("two.ptx", scan + scan);
  }

  test::TemporaryFolder folder_;
};

TEST_F(Campaigns, APoseServesOneScan) {
  const auto scan = folder_.write("scan3.xyz", "1 2 3\n");
  const auto other = folder_.write("tile_03.xyz", "1 2 3\n");
  const auto poses = folder_.write("poses.tsv", std::string(kHeader) + "3 0 0 9 1 0 0 0\n");
  CampaignOptions options;
  options.scans = {scan};
  options.poses = poses;
  EXPECT_EQ(open_campaign(options).front()->info().sensor, (formats::Vector3{0, 0, 9}));
  options.scans = {scan, other};
  EXPECT_THAT(refusal(options, formats::ErrorKind::kInput),
              HasSubstr("the pose 3 is found for two scans"));
}

TEST_F(Campaigns, OneSensorIsNotThatOfSeveralScans) {
  const auto poses = folder_.write("poses.tsv", std::string(kHeader) + "two 0 0 9 1 0 0 0\n");
  CampaignOptions options;
  options.scans = {two_ptx()};
  options.poses = poses;
  for (const bool sensors : {false, true}) {
    options.poses_tell_sensors_only = sensors;
    EXPECT_THAT(refusal(options, formats::ErrorKind::kUsage),
                HasSubstr("one pose is given for the 2 scans of two.ptx"));
  }
}

TEST_F(Campaigns, SensorsAloneAreRefusedWhereNothingTellsThem) {
  const auto scan = folder_.write("a.xyz", "1 2 3\n");
  CampaignOptions options;
  options.scans = {scan};
  options.poses_tell_sensors_only = true;
  EXPECT_THAT(refusal(options, formats::ErrorKind::kUsage), HasSubstr("no poses are given"));
  options.poses = folder_.write("a.conf", "bmesh a.xyz 0 0 9 0 0 0 1\n");
  EXPECT_THAT(refusal(options, formats::ErrorKind::kUsage),
              HasSubstr("the poses of a.conf do not tell where sensors stood"));
}

// A compressed PCD is read whole, LAZ by a process of its own.
TEST_F(Campaigns, AScanWhoseReaderNeedsMoreThanTheMemoryIsRefused) {
  std::string pcd =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 6400000\nHEIGHT 1\nDATA binary_compressed\n";
  test::put<std::uint32_t>(pcd, 1 << 20);
  test::put<std::uint32_t>(pcd, 6400000 * 12);
  pcd.resize(pcd.size() + (1 << 20));
  test::LazBytes laz;
  laz.las.records = {std::string(20, 'x')};
  CampaignOptions options;
  for (const auto& scan : {folder_.write("a.pcd", pcd), folder_.write("a.laz", laz.build())}) {
    options.scans = {scan};
    options.memory_bytes = std::uint64_t{64} << 20;
    EXPECT_THAT(refusal(options, formats::ErrorKind::kUsage),
                HasSubstr("reading " + scan.filename().string()));
    options.memory_bytes = std::uint64_t{128} << 20;
    EXPECT_EQ(open_campaign(options).size(), 1U);
  }
}

}  // namespace
}  // namespace cairn::pipeline
