// Poses read from tables and from the Stanford repository's .conf, and the scans that they belong to.
#include "formats/scans/pose_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/error.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using ::testing::HasSubstr;

class PoseFiles : public ::testing::Test {
 protected:
  PoseFile read(const std::string& text) { return PoseFile(folder_.write("poses.tsv", text)); }

  template <typename Action>
  std::string refusal(Action action) {
    try {
      action();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_THAT(error.what(), HasSubstr("poses.tsv"));
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }
  std::string refusal_of(const std::string& text) {
    return refusal([&] { read(text); });
  }

  test::TemporaryFolder folder_;
};

const std::string kHeader = "scan tx ty tz qw qx qy qz\n";

TEST_F(PoseFiles, ATableMayHaveItsColumnsInAnyOrder) {
  // w = 1, z = 1 is a quarter turn about z.
  for (const std::string& text :
       {kHeader + "a 1 2 3 1 0 0 1\n",
        std::string("# by hand\nqz,qy,qx,qw,scan,tz,ty,tx\n1,0,0,1,a,3,2,1\n")}) {
    const PoseFile file = read(text);
    const PoseFile::Entry& entry = file.find("somewhere/a.las");
    EXPECT_TRUE(entry.tells_sensor);
    EXPECT_EQ(entry.pose.translation, (Vector3{1, 2, 3}));
    const Vector3 placed = place(entry.pose, {1, 0, 0});
    EXPECT_NEAR(placed[0], 1, 1e-12);
    EXPECT_NEAR(placed[1], 3, 1e-12);
  }
}

TEST_F(PoseFiles, StanfordRotationsAreTransposedAndTellNoSensor) {
  const PoseFile file = read("camera 1 2 3 0 0 0 1\nmesh x\nbmesh b.ply 1 2 3 0 0 1 1\n");
  const PoseFile::Entry& entry = file.find("b.ply");
  EXPECT_FALSE(entry.tells_sensor);
  const Vector3 placed = place(entry.pose, {1, 0, 0});
  EXPECT_NEAR(placed[0], 1, 1e-12);
  EXPECT_NEAR(placed[1], 1, 1e-12);  // to -y
}

TEST_F(PoseFiles, FindsByFileThenStemThenNumber) {
  const PoseFile file =
      read(kHeader + "12 0 0 12 1 0 0 0\ns12.las 0 0 1 1 0 0 0\ns12 0 0 2 1 0 0 0\n");
  EXPECT_EQ(file.find("s12.las").pose.translation[2], 1);
  EXPECT_EQ(file.find("s12.laz").pose.translation[2], 2);
  EXPECT_EQ(file.find("scan_0012_world.laz").pose.translation[2], 12);
}

TEST_F(PoseFiles, RefusesNoPose) {
  const PoseFile file = read(kHeader + "1 0 0 0 1 0 0 0\n2 0 0 0 1 0 0 0\n");
  EXPECT_THAT(refusal([&] { file.find("scan3.las"); }),
              HasSubstr("no pose for the scan scan3.las"));
  EXPECT_THAT(refusal([&] { file.find("scan.las"); }), HasSubstr("no pose"));
  // Whether 2 or 2024 is the scan's number, nobody can tell.
  EXPECT_THAT(refusal([&] { file.find("1_2.las"); }), HasSubstr("no pose"));
  EXPECT_THAT(refusal([&] { file.find("scan2_2024.las"); }), HasSubstr("no pose"));
}

TEST_F(PoseFiles, RefusesASecondPoseOfOneScan) {
  EXPECT_THAT(refusal_of(kHeader + "a 0 0 0 1 0 0 0\nb 0 0 0 1 0 0 0\na 1 0 0 1 0 0 0\n"),
              HasSubstr("line 4 of the pose file cannot be used"));
  EXPECT_THAT(refusal_of("bmesh b.ply 1 2 3 0 0 1 1\nbmesh b.ply 1 2 3 0 0 1 1\n"),
              HasSubstr("a second pose of b.ply"));
}

TEST_F(PoseFiles, PassesOverTheMarkOfUtf8) {
  EXPECT_EQ(read("\xef\xbb\xbf" + kHeader + "a 1 2 3 1 0 0 0\n").find("a.las").pose.translation,
            (Vector3{1, 2, 3}));
}

TEST_F(PoseFiles, RefusesDamageNamingTheLine) {
  EXPECT_THAT(refusal_of(""), HasSubstr("holds no poses"));
  EXPECT_THAT(refusal_of("scan tx ty tz qw qx qy\n"), HasSubstr("no column qz"));
  EXPECT_THAT(refusal_of(kHeader + "1 0 0 0 1 0 0\n"), HasSubstr("line 2"));
  EXPECT_THAT(refusal_of(kHeader + "1 0 0 0 1 0 0 0\n2 0 0 zero 1 0 0 0\n"), HasSubstr("line 3"));
  EXPECT_THAT(refusal_of(kHeader + "1 0 0 0 0 0 0 0\n"), HasSubstr("no pose"));
  EXPECT_THAT(refusal_of(kHeader + "1 inf 0 0 1 0 0 0\n"), HasSubstr("no pose"));
  EXPECT_THAT(refusal_of("bmesh a.ply 0 0 0 0 0 1\n"), HasSubstr("found 8 words"));
  EXPECT_THROW(PoseFile(folder_ / "absent"), Error);
}

TEST_F(PoseFiles, FindsTheLivoxScansByNumber) {
  CAIRN_NEEDS_SHARED_DATA();
  const PoseFile file(CAIRN_SHARED_DATA "/campaign_livox/poses.tsv");
  const PoseFile::Entry& entry = file.find("livox_scan12_world.laz");
  EXPECT_EQ(entry.scan, "12");
  EXPECT_NE(file.find("livox_scan13_world.laz").pose.translation, entry.pose.translation);
}

/// Distances to the nearest of some points, by a grid of cells as large as the greatest distance told.
class Nearest {
 public:
  Nearest(const test::ScanPoints& scan, double cell) : cell_(cell) {
    for (std::size_t i = 0; i < scan.points.count; ++i)
      cells_[cell_of(scan.world(i))].push_back(scan.world(i));
  }

  /// The cell's side where nothing is nearer.
  double distance(const Vector3& p) const {
    double least = cell_ * cell_;
    const Cell home = cell_of(p);
    for (long x = -1; x <= 1; ++x)
      for (long y = -1; y <= 1; ++y)
        for (long z = -1; z <= 1; ++z) {
          const auto found = cells_.find({home[0] + x, home[1] + y, home[2] + z});
          if (found == cells_.end()) continue;
          for (const Vector3& q : found->second) {
            const double dx = p[0] - q[0], dy = p[1] - q[1], dz = p[2] - q[2];
            least = std::min(least, dx * dx + dy * dy + dz * dz);
          }
        }
    return std::sqrt(least);
  }

 private:
  using Cell = std::array<long, 3>;
  Cell cell_of(const Vector3& p) const {
    return {std::lround(p[0] / cell_), std::lround(p[1] / cell_), std::lround(p[2] / cell_)};
  }
  double cell_;
  std::map<Cell, std::vector<Vector3>> cells_;
};

// The published mesh was made of these scans, so every scan must lie on it.
TEST_F(PoseFiles, TheBunnysScansMeetItsMesh) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::filesystem::path data = CAIRN_SHARED_DATA;
  const PoseFile poses(data / "campaign_bunny/bun.conf");
  const Nearest mesh(test::read_points(data / "mesh/bun_zipper.ply"), 0.004);
  for (const auto& path : test::files_in(data / "campaign_bunny", ".ply")) {
    const auto scan = test::read_points(path, {.pose = poses.find(path).pose});
    std::vector<double> distances;
    for (std::size_t i = 0; i < scan.points.count; i += 37)
      distances.push_back(mesh.distance(scan.world(i)));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    EXPECT_LT(*middle, 0.001) << path;
  }
}

}  // namespace
}  // namespace cairn::formats
