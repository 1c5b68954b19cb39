// E57 through the real program: all files of others built and proved, hostile ones refused, scans of one file as one
// campaign, and a file larger than the memory that it is read with.
#include <cmath>
#include <limits>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/e57_bytes.h"
#include "tests/support/manifest.h"
#include "tests/support/sanitizers.h"
#include "tests/support/shared_data.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

class E57 : public ProgramTest {
 protected:
  void expect_built_and_proved(const std::vector<std::string>& scans, std::uint64_t records) {
    ASSERT_EQ(build(scans).exit_code, 0);
    const Json told = info();
    EXPECT_EQ(told.at("read"), records);
    EXPECT_EQ(told.at("missing"), 0);
    std::vector<std::string> verify{"verify", "--progress", "none", output(), "--against"};
    verify.insert(verify.end(), scans.begin(), scans.end());
    const Outcome verified = cairn(verify);
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  }

  /// The names and types of a dataset's attributes.
  std::string schema() {
    const Json told = info();
    std::string names;
    for (const Json& attribute : told.at("schema"))
      names += attribute.at("name").get<std::string>() + " " +
               attribute.at("type").get<std::string>() + ", ";
    return names;
  }
};

TEST_F(E57, AllFilesOfTheManifestAreBuiltAndProvedOrRefused) {
  CAIRN_NEEDS_SHARED_DATA();
  std::size_t built = 0, refused = 0;
  for (const ManifestEntry& entry : read_manifest(CAIRN_SHARED_DATA "/MANIFEST.tsv")) {
    if (!entry.path.ends_with(".e57")) continue;
    SCOPED_TRACE(entry.path);
    const std::string path = CAIRN_SHARED_DATA "/" + entry.path;
    if (entry.points.value_or(0) > 0) {
      expect_built_and_proved({path}, *entry.points);
      fs::remove_all(output());
      ++built;
    } else {
      const Outcome outcome = build({path});
      expect_refusal(outcome, 3);
      EXPECT_THAT(outcome.err, HasSubstr(fs::path(path).filename().string()));
      ++refused;
    }
  }
  EXPECT_EQ(built, 25U);
  EXPECT_EQ(refused, 10U);
}

TEST_F(E57, FilesWithoutPointsSaySo) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const char* name : {"ZeroPoints", "ZeroPointsInvalid", "empty_pc", "InvalidCVHeader"}) {
    const Outcome outcome = build({CAIRN_SHARED_DATA "/hostile/" + std::string(name) + ".e57"});
    expect_refusal(outcome, 3);
    EXPECT_THAT(outcome.err, HasSubstr("no usable point in the campaign"));
  }
}

TEST_F(E57, ScansOfOneFileMergeAsACampaignDoes) {
  CAIRN_NEEDS_SHARED_DATA();
  // One has intensities alone, the other colours alone.
  expect_built_and_proved({CAIRN_SHARED_DATA "/e57/A_B_different_dims.e57"}, 2);
  EXPECT_EQ(schema(), "intensity float32, color uint8, ");
}

TEST_F(E57, PosedScansAndTheirNeighboursAreOneCampaign) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::string folder = CAIRN_SHARED_DATA "/campaign_livox";
  expect_built_and_proved(
      {folder + "/livox_scans_9_10_11_posed.e57", folder + "/livox_scan12_world.laz"},
      974370 + 289789);
  EXPECT_EQ(info().at("sources").size(), 4U);
}

TEST_F(E57, InvalidRecordsAreCountedAsNoReturn) {
  E57ScanBytes scan{.streams = e57_line(1000)};
  std::vector<std::int64_t> state(1000, 0);
  for (std::size_t i = 0; i < state.size(); i += 4) state[i] = i % 8 == 0 ? 1 : 2;
  scan.streams.push_back(e57_integers("cartesianInvalidState", 0, 2, state));
  const std::string path = folder_.write("scan.e57", E57Bytes{.scans = {scan}}.bytes());
  expect_built_and_proved({path}, 1000);
  EXPECT_EQ(info().at("points"), 750);
  EXPECT_EQ(info().at("dropped"), 250);
  EXPECT_EQ(info().at("sources").at(0).at("dropped").at("no_return"), 250);
}

/// Points along the diagonal of a cube with this side, on integer steps of this scale.
E57ScanBytes diagonal(double side, double scale, const std::string& xml = "") {
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  std::vector<std::int64_t> values;
  for (int i = 0; i < 1000; ++i) values.push_back(std::llround(side * i / 999 / scale));
  E57ScanBytes scan{.streams = {}, .xml = xml};
  std::ostringstream text;
  text << "scale=\"" << scale << '"';
  for (const char* name : {"cartesianX", "cartesianY", "cartesianZ"})
    scan.streams.push_back(e57_scaled(name, 0, kMost, text.str(), values));
  return scan;
}

std::string pose_xml(const std::string& x) {
  return "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">1</w></rotation>"
         "<translation type=\"Structure\"><x type=\"Float\">" +
         x + "</x></translation></pose>";
}

TEST_F(E57, FineStepsOfScansThatShareNoneAreNoPromise) {
  // Micrometres over 1,100 m and, posed, a metre farther: 2^-19 is the smallest power of two by which that fits 30 bits.
  for (const std::string& first : {std::string(), pose_xml("0"), pose_xml("0.1")}) {
    const std::string path = folder_.write(
        "site.e57",
        E57Bytes{.scans = {diagonal(1100, 1e-6, first), diagonal(1100, 1e-6, pose_xml("1"))}}
            .bytes());
    expect_built_and_proved({path}, 2000);
    EXPECT_EQ(info().at("grid").at("step").at(0), std::ldexp(1.0, -19));
    fs::remove_all(output());
  }
  // Both divide their box by what 32 bits hold.
  const std::string path = folder_.write(
      "tiny.e57", E57Bytes{.scans = {diagonal(50, 2.5e-8), diagonal(60, 3e-8)}}.bytes());
  expect_built_and_proved({path}, 2000);
  EXPECT_EQ(info().at("grid").at("step").at(0), std::ldexp(1.0, -24));
}

TEST_F(E57, StepsThatScansShareStay) {
  const std::string path = folder_.write(
      "site.e57", E57Bytes{.scans = {diagonal(1100, 1e-6), diagonal(1100, 2e-6)}}.bytes());
  expect_built_and_proved({path}, 2000);
  EXPECT_EQ(info().at("grid").at("step").at(0), 1e-6);
}

TEST_F(E57, OnePoseForSeveralScansIsRefused) {
  const E57ScanBytes scan{.streams = e57_line(10)};
  const std::string path = folder_.write("pair1.e57", E57Bytes{.scans = {scan, scan}}.bytes());
  const std::string poses =
      folder_.write("poses.txt", "scan tx ty tz qw qx qy qz\npair1 0 0 0 1 0 0 0\n");
  const Outcome outcome = build({path, "--poses", poses});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err, HasSubstr("2 scans of pair1.e57"));
}

using LongE57 = E57;

TEST_F(LongE57, TwoGibibytesAreImportedIn256Mebibytes) {
  const std::string path = folder_ / "large.e57";
  const Outcome made =
      run_program(CAIRN_MAKE_SCAN, {"--points", "168000000", "--shape", "facade", "-o", path});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  ASSERT_GE(fs::file_size(path), std::uint64_t{2} << 30);
  const Outcome built = build({path, "--memory", "256MiB", "--reducer", "first"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_EQ(info().at("points"), 168000000);
  const Json record = Json::parse(read_text(output() + "/run.json"));
  std::printf("peak memory %.1f MiB, %.0f s\n",
              record.at("peak_memory_bytes").get<double>() / (1 << 20),
              record.at("elapsed_s").get<double>());
  if (kPeakMemoryCounts) EXPECT_LE(record.at("peak_memory_bytes").get<double>(), 1.1 * (256 << 20));
}

}  // namespace
}  // namespace cairn::test
