// Real scans through build, verify, info and export, held against an independent parse of the input.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/las_points.h"
#include "tests/support/manifest.h"
#include "tests/support/shared_data.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class RoundTrip : public ProgramTest {
 protected:
  /// Builds with the preset, verifies against the scans and returns the info.
  Json build_and_verify(const std::vector<std::string>& scans,
                        const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = scans;
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const Outcome built = build(arguments);
    EXPECT_EQ(built.exit_code, 0) << built.err;
    if (built.exit_code != 0) return {};
    std::vector<std::string> verify{"verify", "--progress", "none", output(), "--against"};
    verify.insert(verify.end(), scans.begin(), scans.end());
    const Outcome verified = cairn(verify);
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    return info();
  }

  /// The vertices of an exported PLY, whose first three properties are doubles x, y, z.
  std::vector<std::array<double, 3>> read_positions(const std::string& path, std::uint64_t count) {
    const std::string bytes = read_text(path);
    const std::size_t start = bytes.find("end_header\n") + 11;
    const std::size_t stride = count == 0 ? 0 : (bytes.size() - start) / count;
    std::vector<std::array<double, 3>> positions(count);
    for (std::uint64_t i = 0; i < count; ++i)
      std::memcpy(&positions[i], &bytes[start + i * stride], 24);
    return positions;
  }
};

/// Point counts by path inside the shared folder.
std::map<std::string, std::uint64_t> manifest_counts() {
  std::map<std::string, std::uint64_t> counts;
  for (const ManifestEntry& entry : read_manifest(CAIRN_SHARED_DATA "/MANIFEST.tsv"))
    if (entry.points) counts[entry.path] = *entry.points;
  return counts;
}

/// The grid point nearest to a world position.
std::array<std::int64_t, 3> on_grid(const Json& grid, const std::array<double, 3>& world) {
  std::array<std::int64_t, 3> point{};
  for (std::size_t a = 0; a < 3; ++a)
    point[a] = std::llround((world[a] - grid.at("offset")[a].get<double>()) /
                            grid.at("step")[a].get<double>()) -
               grid.at("shift")[a].get<std::int64_t>();
  return point;
}

/// The x y z of the vertices of an ascii PLY whose vertices come first and begin with them.
std::vector<std::array<double, 3>> read_ascii_ply(const fs::path& path, std::uint64_t count) {
  std::istringstream in(read_text(path));
  std::string line;
  while (std::getline(in, line) && !line.starts_with("end_header")) continue;
  std::vector<std::array<double, 3>> positions(count);
  for (auto& position : positions) {
    std::getline(in, line);
    std::istringstream words(line);
    float value = 0;
    for (double& coordinate : position)
      coordinate = words >> value ? static_cast<double>(value) : NAN;
  }
  return positions;
}

TEST_F(RoundTrip, ThreadsChangeNoByteOfALazCampaign) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto built_with = [&](const char* threads) {
    std::vector<std::string> arguments{"--threads", threads, "--reducer", "first"};
    for (const char* name : {"ALS_Clip.laz", "MLS_Clip.laz", "UAS_Clip.laz"})
      arguments.push_back(std::string(CAIRN_SHARED_DATA "/campaign_plot/") + name);
    EXPECT_EQ(build(arguments).exit_code, 0);
    std::string bytes;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      bytes += read_text(output() + "/" + file);
    fs::remove_all(output());
    return bytes;
  };
  EXPECT_TRUE(built_with("1") == built_with("3"));
}

TEST_F(RoundTrip, ThePeakOfMemoryHoldsTheWorkersThatDecode) {
  CAIRN_NEEDS_SHARED_DATA();
  // Of the import alone: other stages may need more than it needs with its workers.
  const auto peak_of_import = [&](const char* scan) {
    EXPECT_EQ(build({std::string(CAIRN_SHARED_DATA "/") + scan}).exit_code, 0);
    const Json run = Json::parse(read_text(output() + "/run.json"));
    fs::remove_all(output());
    const Json& stages = run.at("stages");
    const auto import =
        std::ranges::find(stages, "import", [](const Json& s) { return s.at("name"); });
    if (import == stages.end()) throw std::runtime_error("run.json tells of no import");
    const auto peak = import->at("peak_memory_bytes").get<std::uint64_t>();
    EXPECT_GE(run.at("peak_memory_bytes").get<std::uint64_t>(), peak);
    return peak;
  };
  constexpr std::uint64_t kLeastNodeJs = std::uint64_t{20} << 20;
  EXPECT_GT(peak_of_import("laz/autzen_trim.laz"),
            peak_of_import("las/autzen_trim.las") + kLeastNodeJs);
}

TEST_F(RoundTrip, TheBunnysSixScansComeBackToTheGrid) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto counts = manifest_counts();
  std::vector<std::string> scans;
  std::vector<std::array<double, 3>> input;
  for (const fs::path& scan : files_in(CAIRN_SHARED_DATA "/campaign_bunny", ".ply")) {
    scans.push_back(scan);
    const auto part = read_ascii_ply(scan, counts.at("campaign_bunny/" + scan.filename().string()));
    input.insert(input.end(), part.begin(), part.end());
  }
  ASSERT_FALSE(scans.empty());
  const Json told = build_and_verify(scans, {"--preset", "archive", "--node-points", "5000"});
  ASSERT_TRUE(told.is_object());
  EXPECT_EQ(told.at("points"), input.size());
  const std::string back = folder_ / "back.ply";
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", back}).exit_code, 0);
  std::vector<std::array<std::int64_t, 3>> expected, found;
  for (const auto& position : input) expected.push_back(on_grid(told.at("grid"), position));
  for (const auto& position : read_positions(back, input.size()))
    found.push_back(on_grid(told.at("grid"), position));
  std::sort(expected.begin(), expected.end());
  std::sort(found.begin(), found.end());
  EXPECT_TRUE(expected == found);
}

TEST_F(RoundTrip, InfoHasTheKeysThatProgramsNeed) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 20000);
  const Json told = build_and_verify({scan}, {"--fanout", "3", "--node-points", "700"});
  ASSERT_TRUE(told.is_object());
  EXPECT_EQ(told.at("points"), 20000);
  EXPECT_EQ(told.at("dropped"), 0);
  EXPECT_EQ(told.at("missing"), 0);
  for (const char* key : {"schema", "bounds", "grid", "parameters", "version"})
    EXPECT_TRUE(told.contains(key)) << key;
  // 20000 / 700 lies between 3^3 and 3^4, nearest to 3^3; ceil(20000 / 27) = 741.
  const Json& tree = told.at("tree");
  EXPECT_EQ(tree.at("fanout"), 3);
  EXPECT_EQ(tree.at("levels"), 4);
  EXPECT_EQ(tree.at("nodes"), 1 + 3 + 9 + 27);
  EXPECT_EQ(tree.at("node_points"), 741);
  EXPECT_EQ(tree.at("leaf_points"), Json({{"min", 740}, {"max", 741}}));
  EXPECT_EQ(tree.at("inner_points"), Json({{"min", 741}, {"max", 741}}));
  std::uint64_t total = 0;
  for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
    total += fs::file_size(output() + "/" + file);
  EXPECT_EQ(told.at("bytes").at("nodes"), fs::file_size(output() + "/nodes.bin"));
  EXPECT_EQ(told.at("bytes").at("index"), fs::file_size(output() + "/index.bin"));
  EXPECT_EQ(told.at("bytes").at("total"), total);
  EXPECT_EQ(told.at("levels").size(), 4U);
}

TEST_F(RoundTrip, EachLevelCanBeExported) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 20000);
  ASSERT_EQ(build({scan, "--fanout", "3", "--node-points", "700"}).exit_code, 0);
  for (int level = 0; level < 4; ++level) {
    const std::string back = folder_ / ("level" + std::to_string(level) + ".las");
    ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", back, "--level",
                     std::to_string(level)})
                  .exit_code,
              0);
    const std::size_t nodes = static_cast<std::size_t>(std::lround(std::pow(3, level)));
    EXPECT_EQ(read_las(back).points.size(), level == 3 ? 20000U : 741U * nodes);
  }
  EXPECT_EQ(cairn({"export", output(), "-o", folder_ / "x.las", "--level", "4"}).exit_code, 2);
  EXPECT_EQ(cairn({"export", output(), "-o", folder_ / "level0.las"}).exit_code, 2);
  EXPECT_EQ(cairn({"export", output(), "-o", folder_ / "level0.las", "--force"}).exit_code, 0);
  EXPECT_EQ(cairn({"export", output(), "-o", folder_ / "x.e57"}).exit_code, 2);
}

TEST_F(RoundTrip, ThreadsAndMemoryChangeNoByte) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 300000);
  std::vector<std::string> seen;
  for (const std::vector<std::string>& flags : std::vector<std::vector<std::string>>{
           {"--threads", "1"}, {"--threads", "2"}, {"--threads", "7"}, {"--memory", "64MiB"}}) {
    std::vector<std::string> arguments{scan, "--node-points", "4000"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    ASSERT_EQ(build(arguments).exit_code, 0);
    std::string bytes;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      bytes += read_text(output() + "/" + file);
    seen.push_back(std::move(bytes));
    fs::remove_all(output());
  }
  for (const std::string& bytes : seen) EXPECT_TRUE(bytes == seen.front());
}

TEST_F(RoundTrip, TimingsStandInTheRunRecordAlone) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 5000)}).exit_code, 0);
  const Json run = Json::parse(read_text(output() + "/run.json"));
  EXPECT_GT(run.at("elapsed_s"), 0);
  EXPECT_GT(run.at("peak_memory_bytes"), 0);
  EXPECT_GE(run.at("stages").size(), 3U);
  fs::remove(output() + "/run.json");
  EXPECT_EQ(cairn({"info", output()}).exit_code, 0);
  EXPECT_EQ(cairn({"verify", "--progress", "none", output()}).exit_code, 0);
}

}  // namespace
}  // namespace cairn::test
