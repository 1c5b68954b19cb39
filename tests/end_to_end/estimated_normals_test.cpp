// Estimated normals against the true ones: a simulated scene tells the normal of the surface at every point.
#include <algorithm>
#include <array>
#include <cmath>

#include "tests/end_to_end/program_test.h"
#include "tests/support/scan_points.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;

constexpr double kDegrees = 180 / 3.14159265358979323846;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Between the lines of two directions, whichever way they point.
double angle_between_lines(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const double cosine = std::fabs(dot(a, b)) / std::sqrt(dot(a, a) * dot(b, b));
  return std::acos(std::min(1.0, cosine)) * kDegrees;
}

double quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// How the normals of some points came out.
struct Deviation {
  std::vector<double> angles;  ///< degrees
  std::size_t turned_right = 0;

  void add(const std::array<double, 3>& estimated, const std::array<double, 3>& truth) {
    angles.push_back(angle_between_lines(estimated, truth));
    if (dot(estimated, truth) > 0) ++turned_right;
  }
  double share_turned_right() const {
    return static_cast<double>(turned_right) / static_cast<double>(angles.size());
  }
};

class LongEstimatedNormals : public ProgramTest {
 protected:
  /// Scans of the statue in the world's frame, their normals under names that mean nothing to the program.
  std::string simulate(const std::string& points) {
    const std::string scene =
        read_text(CAIRN_SOURCE "/configs/scenes/statue.toml") + "\n[output]\nframe = \"world\"\n";
    const std::string folder = folder_ / "statue";
    const Outcome made = cairn({"simulate", folder_.write("statue.toml", scene), "-o", folder,
                                "--progress", "none", "--format", "ply", "--points", points});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    for (const auto& file : fs::directory_iterator(folder))
      if (file.path().extension() == ".ply") rename_normals(file.path());
    return folder + "/campaign.toml";
  }

  static void rename_normals(const fs::path& scan) {
    std::string bytes = read_text(scan);
    for (const char axis : {'x', 'y', 'z'}) {
      const std::size_t at = bytes.find(std::string(" n") + axis + "\n");
      ASSERT_LT(at, bytes.find("end_header"));
      bytes[at + 1] = 'a';
    }
    write_text(scan, bytes);
  }

  static std::array<double, 3> truth(const ScanPoints& scan, std::size_t point) {
    return {scan.value<float>("ax", point), scan.value<float>("ay", point),
            scan.value<float>("az", point)};
  }
  static std::array<double, 3> estimated(const ScanPoints& scan, std::size_t point) {
    return {scan.value<float>("normal", point, 0), scan.value<float>("normal", point, 1),
            scan.value<float>("normal", point, 2)};
  }
};

TEST_F(LongEstimatedNormals, OfAMillionPointsOfTheStatueAreThoseOfItsSurface) {
  const std::string campaign = simulate("1000000");
  ASSERT_EQ(build({campaign, "--estimate", "normals", "--neighbors", "16", "--lossless-leaves"})
                .exit_code,
            0);
  EXPECT_EQ(info().at("schema").back().at("estimated"), true);
  const std::string back = folder_ / "back.ply";
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", back}).exit_code, 0);
  const ScanPoints scan = read_points(back);
  EXPECT_NEAR(static_cast<double>(scan.points.count), 1e6, 0.05e6);
  Deviation all, not_level;
  for (std::size_t i = 0; i < scan.points.count; ++i) {
    const auto normal = estimated(scan, i), surface = truth(scan, i);
    ASSERT_GT(dot(normal, normal), 0) << "no normal at point " << i;
    all.add(normal, surface);
    // The ground is most of the points and easy.
    if (std::fabs(surface[2]) < 0.999) not_level.add(normal, surface);
  }
  for (auto* deviation : {&all, &not_level}) {
    const std::string name = deviation == &all ? "all" : "not_level";
    RecordProperty(name + "_points", std::to_string(deviation->angles.size()));
    RecordProperty(name + "_median", std::to_string(quantile(deviation->angles, 0.5)));
    RecordProperty(name + "_p95", std::to_string(quantile(deviation->angles, 0.95)));
    RecordProperty(name + "_turned", std::to_string(deviation->share_turned_right()));
  }
  EXPECT_GT(not_level.angles.size(), 100'000U);
  // Edges of the plinth and folds of the statue are within reach of 16 neighbors of one point in twenty.
  EXPECT_LT(quantile(all.angles, 0.5), 1);
  EXPECT_LT(quantile(all.angles, 0.95), 6);
  EXPECT_LT(quantile(not_level.angles, 0.5), 1);
  EXPECT_LT(quantile(not_level.angles, 0.95), 12);
  EXPECT_GE(all.share_turned_right(), 0.99);
  EXPECT_GE(not_level.share_turned_right(), 0.99);
}

}  // namespace
}  // namespace cairn::test
