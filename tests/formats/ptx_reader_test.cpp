// PTX files, written by hand for each rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "formats/error.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Position = std::array<double, 3>;

// A quarter turn about z, as a row vector sees it, and a translation.
const std::string kPosed =
    "10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n";
const std::string kPlain = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

class PtxReader : public ::testing::Test {
 protected:
  std::vector<test::ScanPoints> read(const std::string& text, const ScanOptions& options = {}) {
    std::vector<test::ScanPoints> scans;
    for (const auto& reader : open_scans(folder_.write("scan.ptx", text), options))
      scans.push_back(test::read_points(*reader));
    return scans;
  }

  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_THAT(error.what(), HasSubstr("scan.ptx"));
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  test::TemporaryFolder folder_;
};

TEST_F(PtxReader, PlacesPointsByTheMatrixAndTheSensorAtItsOrigin) {
  const auto scans = read("1\n2\n" + kPosed + "1 2 3 0.5\n4 5 6 0.25\n");
  ASSERT_EQ(scans.size(), 1U);
  const auto& scan = scans.front();
  ASSERT_EQ(scan.points.count, 2U);
  // (1, 2, 3) as a row vector times the matrix: (-2, 1, 3), moved by (10, 20, 30).
  EXPECT_EQ(scan.world(0), (Position{8, 21, 33}));
  EXPECT_EQ(scan.info.sensor, (Vector3{10, 20, 30}));
  EXPECT_EQ(scan.info.part, "");
  EXPECT_THAT(scan.names(), ElementsAre("intensity"));
  EXPECT_EQ(scan.value<float>("intensity", 1), 0.25F);
}

TEST_F(PtxReader, EmptyCellsHoldNoPoint) {
  const auto scan = read("2\n2\n" + kPlain +
                         "0 0 0 0.5 0 0 0\n1 2 3 0.1 7 8 9\n0 0 0 0.5 0 0 0\n0 0 1 0.2 4 5 6\n")
                        .front();
  EXPECT_EQ(scan.points.count, 2U);
  EXPECT_EQ(scan.points.no_return, 2U);
  EXPECT_EQ(scan.info.claimed_points, 4U);
  EXPECT_EQ(scan.world(1), (Position{0, 0, 1}));
  EXPECT_EQ(scan.value<std::uint8_t>("color", 1, 2), 6);
  EXPECT_EQ(scan.value<float>("intensity", 0), 0.1F);
}

TEST_F(PtxReader, ScansOfOneFileHaveTheirPosesAndOneSetOfTypes) {
  const auto scans = read("1\n1\n" + kPosed + "1 2 3 7\n1\n2\n" + kPlain + "4 5 6 0.5\n7 8 9 1\n");
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].info.part, "scan 1");
  EXPECT_EQ(scans[1].info.part, "scan 2");
  EXPECT_EQ(scans[0].world(0), (Position{8, 21, 33}));
  EXPECT_EQ(scans[1].world(1), (Position{7, 8, 9}));
  EXPECT_EQ(scans[1].info.sensor, (Vector3{0, 0, 0}));
  EXPECT_EQ(scans[0].info.schema, scans[1].info.schema);
  EXPECT_EQ(scans[0].value<float>("intensity", 0), 7);
}

TEST_F(PtxReader, ContentDecides) {
  const auto path = folder_.write("scan.txt", "1\n1\n" + kPosed + "1 2 3 0.5\n");
  EXPECT_EQ(test::read_points(path).world(0), (Position{8, 21, 33}));
}

TEST_F(PtxReader, RefusesDamage) {
  EXPECT_THAT(refusal("2\n2\n" + kPlain + "1 2 3 4\n"), HasSubstr("found 1 cells, expected 2 x 2"));
  EXPECT_THAT(refusal("2\n1\n" + kPlain + "1 2 3 4\n5 6 7\n"),
              HasSubstr("line 12: too few values"));
  EXPECT_THAT(refusal("1\n1\n" + kPlain + "1 2 3\n"), HasSubstr("expected 4 or 7"));
  EXPECT_THAT(refusal("1\n1\n" + kPlain + "1 2 3 4\n1\n"), HasSubstr("inside the header"));
  EXPECT_THAT(refusal("2\n1\n" + kPlain + "1 2 3 4\n1\n1\n" + kPlain + "1 2 3 4\n"),
              HasSubstr("line 12: too few values"));
  EXPECT_THAT(refusal("1.5\n1\n" + kPlain + "1 2 3 4\n"), HasSubstr("size of the grid"));
  EXPECT_THAT(refusal("4294967296\n4294967296\n" + kPlain + "1 2 3 4\n"),
              HasSubstr("more cells than can be counted"));
  EXPECT_THAT(refusal("4294967295\n4294967295\n" + kPlain + "1 2 3 4\n"),
              HasSubstr("found 1 cells"));
  EXPECT_THAT(
      refusal("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 1\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 4\n"),
      HasSubstr("no pose"));
  EXPECT_THAT(
      refusal("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n1 2 3 4\n"),
      HasSubstr("pose of a scan cannot be used"));
}

TEST_F(PtxReader, AllowTruncatedKeepsTheCellsThatAreThere) {
  const auto scans =
      read("2\n2\n" + kPlain + "1 2 3 4\n0 0 0 1\n5 6 7 8", {.allow_truncated = true});
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].points.count, 1U);
  EXPECT_EQ(scans[0].points.no_return, 1U);
  EXPECT_EQ(scans[0].info.claimed_points, 4U);
}

TEST_F(PtxReader, OnePoseForSeveralScansIsAUsageError) {
  const auto path =
      folder_.write("scan.ptx", "1\n1\n" + kPosed + "1 2 3 7\n1\n1\n" + kPlain + "4 5 6 7\n");
  EXPECT_THROW(open_scans(path, {.pose = Pose{}}), Error);
}

}  // namespace
}  // namespace cairn::formats
