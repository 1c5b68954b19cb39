// E57 files of other programs against the same points in other files: the bunny in PTS, a pump in PTX, and Livox scans
// beside their neighbours in one frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <unordered_map>

#include "formats/error.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"

namespace cairn::formats {
namespace {

using ::testing::HasSubstr;
using Position = std::array<double, 3>;
const std::filesystem::path kShared = CAIRN_SHARED_DATA;

/// The positions of a cloud in millionths, sorted.
std::vector<std::array<std::int64_t, 3>> millionths(const test::ScanPoints& scan) {
  std::vector<std::array<std::int64_t, 3>> steps(scan.points.count);
  for (std::size_t i = 0; i < steps.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      steps[i][axis] = std::llround(scan.world(i)[axis] * 1e6);
  std::sort(steps.begin(), steps.end());
  return steps;
}

TEST(E57Samples, TheBunnyIsThatOfItsTextInAllEncodings) {
  CAIRN_NEEDS_SHARED_DATA();
  // The text has six decimals; so have the integers.
  const auto text = test::read_points(kShared / "text/bunnyData.pts");
  const std::map<std::string, PositionEncoding> files{
      {"bunnyDouble", PositionEncoding::kFloat64}, {"bunnyFloat", PositionEncoding::kFloat32},
      {"bunnyInt19", PositionEncoding::kSteps},    {"bunnyInt21", PositionEncoding::kSteps},
      {"bunnyInt24", PositionEncoding::kSteps},    {"bunnyInt32", PositionEncoding::kSteps}};
  for (const auto& [name, encoding] : files) {
    const auto scan = test::read_points(kShared / "e57" / (name + ".e57"));
    EXPECT_EQ(scan.info.encoding, encoding) << name;
    EXPECT_TRUE(millionths(scan) == millionths(text)) << name;
  }
}

TEST(E57Samples, ThePumpIsThatOfItsPtx) {
  CAIRN_NEEDS_SHARED_DATA();
  // Every second row and column as PTX, column by column.
  const auto scan = test::read_points(kShared / "e57/pumpARowColumnIndexNoInvalidPoints.e57");
  const auto text = test::read_points(kShared / "text/pumpA_half.ptx");
  EXPECT_THAT(scan.names(),
              testing::ElementsAre("color", "intensity", "row_index", "column_index"));
  std::map<std::pair<int, int>, std::size_t> even;
  for (std::size_t i = 0; i < scan.points.count; ++i) {
    const int row = scan.value<std::uint16_t>("row_index", i);
    const int column = scan.value<std::uint16_t>("column_index", i);
    if (row % 2 == 0 && column % 2 == 0) even[{column, row}] = i;
  }
  ASSERT_EQ(even.size(), text.points.count);
  std::size_t next = 0;
  for (const auto& [cell, i] : even) {
    // The text has six digits.
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(scan.world(i)[axis], text.world(next)[axis], 0.6e-5) << next;
    for (std::size_t channel = 0; channel < 3; ++channel)
      ASSERT_EQ(scan.value<std::uint8_t>("color", i, channel),
                text.value<std::uint8_t>("color", next, channel))
          << next;
    ASSERT_NEAR(scan.value<float>("intensity", i), text.value<float>("intensity", next), 1e-4)
        << next;
    ++next;
  }
}

/// Whether a point of a cloud lies within a distance.
class Nearby {
 public:
  Nearby(const test::ScanPoints& cloud, double reach) : reach_(reach) {
    for (std::size_t i = 0; i < cloud.points.count; ++i)
      cells_[hash(cell(cloud.world(i)))].push_back(cloud.world(i));
  }

  bool has(const Position& p) const {
    const auto middle = cell(p);
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto at = cells_.find(
          hash({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1}));
      if (at == cells_.end()) continue;
      for (const Position& q : at->second)
        if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) <= reach_) return true;
    }
    return false;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell(const Position& p) const {
    Cell c;
    for (std::size_t axis = 0; axis < 3; ++axis)
      c[axis] = static_cast<std::int64_t>(std::floor(p[axis] / reach_));
    return c;
  }
  static std::uint64_t hash(const Cell& c) {
    return static_cast<std::uint64_t>(c[0] * 73856093 ^ c[1] * 19349663 ^ c[2] * 83492791);
  }

  double reach_;
  std::unordered_map<std::uint64_t, std::vector<Position>> cells_;
};

TEST(E57Samples, PosedScansLieOnTheirNeighbourInTheWorld) {
  CAIRN_NEEDS_SHARED_DATA();
  // Scan 12, which follows scan 11, was brought into the frame by the same poses, by another program.
  constexpr double kReach = 0.1;
  const Nearby neighbour(test::read_points(kShared / "campaign_livox/livox_scan12_world.laz"),
                         kReach);
  const auto path = kShared / "campaign_livox/livox_scans_9_10_11_posed.e57";
  const auto scans = open_scans(path, {});
  ASSERT_EQ(scans.size(), 3U);
  std::ifstream poses(kShared / "campaign_livox/poses.tsv");
  std::string head;
  std::getline(poses, head);
  for (const auto& scan : scans) {
    Vector3 sensor;
    double number = 0, rest = 0;
    poses >> number >> sensor[0] >> sensor[1] >> sensor[2] >> rest >> rest >> rest >> rest;
    EXPECT_EQ(scan->info().sensor, sensor) << number;
  }
  const auto near_of = [&](const ScanReader& reader) {
    const auto points = test::read_points(reader);
    std::size_t near = 0;
    constexpr std::size_t kEvery = 37;
    for (std::size_t i = 0; i < points.points.count; i += kEvery)
      near += neighbour.has(points.world(i)) ? 1 : 0;
    return static_cast<double>(near) * kEvery / static_cast<double>(points.points.count);
  };
  EXPECT_GT(near_of(*scans[2]), 0.4);
  // Scan 9 looks elsewhere.
  EXPECT_GT(near_of(*scans[2]), 2 * near_of(*scans[0]));
}

TEST(E57Samples, ReturnsOfLasFilesAreCountedFromOneAlready) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const char* name : {"ColourRepresentation", "las2e57_no_images_tag"}) {
    const auto scan = test::read_points(kShared / "e57" / (std::string(name) + ".e57"));
    ASSERT_EQ(scan.points.count, 153U);
    for (std::size_t i = 0; i < scan.points.count; ++i) {
      EXPECT_EQ(scan.value<std::uint8_t>("return_number", i), 1);
      EXPECT_LE(scan.value<std::uint8_t>("return_number", i),
                scan.value<std::uint8_t>("return_count", i));
    }
  }
}

TEST(E57Samples, ImagesAloneAreNoScan) {
  CAIRN_NEEDS_SHARED_DATA();
  try {
    open_scans(kShared / "e57/PinholeImageWithDistortionParameters.e57", {});
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr("the E57 file holds no scan"));
    EXPECT_THAT(error.what(), HasSubstr("found 3 images"));
  }
}

}  // namespace
}  // namespace cairn::formats
