// Simulated campaigns, from the scene to the proved dataset.
#include <cmath>

#include "formats/scans/pose_file.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/scan_points.h"

namespace cairn::test {
namespace {

using formats::Vector3;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// A floor, a ball of radius 1 on it and a box, far from the origin, seen from two turned stations.
const std::string kScene = R"(
[[object]]
type = "plane"
position = [431000.0, 5810000.0, 52.0]
size = [20.0, 20.0]
[[object]]
type = "sphere"
position = [431002.0, 5810001.0, 53.0]
radius = 1.0
color = [200, 10, 10]
[[object]]
type = "box"
position = [430998.0, 5810000.0, 53.0]
size = [1.0, 2.0, 2.0]
[[station]]
name = "first"
position = [431000.0, 5809996.0, 53.7]
heading = [77.0, 3.0, -2.0]
counts = [300, 150]
[[station]]
position = [431000.5, 5810004.0, 54.1]
heading = [-110.0, 0.0, 1.0]
counts = [300, 150]
)";

/// How far a point is from the nearest surface of the scene.
double misfit(const Vector3& p) {
  const Vector3 q{p[0] - 431000, p[1] - 5810000, p[2] - 52};
  const double ball = std::hypot(q[0] - 2, q[1] - 1, q[2] - 1) - 1;
  const double box =
      std::max({std::fabs(q[0] + 2) - 0.5, std::fabs(q[1]) - 1, std::fabs(q[2] - 1) - 1});
  return std::min({std::fabs(q[2]), std::fabs(ball), std::fabs(box)});
}

class Simulate : public ProgramTest {
 protected:
  std::string scene(const std::string& text = kScene) { return folder_.write("scene.toml", text); }
  std::string campaign() const { return folder_ / "site"; }
  Outcome simulate(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"simulate", "--progress", "none", "-o", campaign()});
    return cairn(std::move(arguments));
  }
  std::vector<std::string> contents() const {
    std::vector<std::string> bytes;
    for (const char* suffix : {".ply", ".las", ".tsv", ".toml"})
      for (const auto& path : files_of(suffix)) bytes.push_back(read_text(path));
    return bytes;
  }
  std::vector<std::filesystem::path> files_of(const std::string& suffix) const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(campaign()))
      if (entry.path().extension() == suffix) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }
  void expect_nothing_made(const Outcome& outcome, int exit_code) {
    expect_refusal(outcome, exit_code);
    EXPECT_FALSE(std::filesystem::exists(campaign()));
    EXPECT_FALSE(std::filesystem::exists(campaign() + ".scans.work"));
  }
};

TEST_F(Simulate, PosedPointsLieOnTheSurfacesInTheWorld) {
  for (const std::string format : {"ply", "las"}) {
    ASSERT_EQ(simulate({scene(), "--format", format, "--force"}).exit_code, 0);
    const formats::PoseFile poses(folder_ / "site/poses.tsv");
    ASSERT_EQ(files_of("." + format).size(), 2U);
    for (const auto& file : files_of("." + format)) {
      const ScanPoints scan = read_points(file, {.pose = poses.find(file).pose});
      EXPECT_GT(scan.points.count, 5000U);
      // A step of LAS is 1e-5, a step of a double at these coordinates 1e-9.
      const double tolerance = format == "las" ? 2e-5 : 1e-8;
      for (std::size_t i = 0; i < scan.points.count; ++i)
        ASSERT_LT(misfit(scan.world(i)), tolerance) << file << " " << i;
      for (const char* attribute : {"normal", "intensity", "color"})
        EXPECT_TRUE(formats::find_attribute(scan.info.schema, attribute)) << attribute;
    }
  }
}

TEST_F(Simulate, TheCampaignBuildsADatasetThatIsProvedAgainstIt) {
  for (const std::string frame : {"sensor", "world"}) {
    const Outcome made =
        simulate({scene("[output]\nframe = \"" + frame + "\"\n" + kScene), "--force"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const Outcome built =
        cairn({"build", campaign() + "/campaign.toml", "--progress", "none", "--force"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
    const Outcome proved = cairn(
        {"verify", output(), "--progress", "none", "--against", campaign() + "/campaign.toml"});
    EXPECT_EQ(proved.exit_code, 0) << proved.out << proved.err;
    const Outcome exported =
        cairn({"export", output(), "--progress", "none", "--force", "-o", folder_ / "points.ply"});
    ASSERT_EQ(exported.exit_code, 0) << exported.err;
    const ScanPoints points = read_points(folder_ / "points.ply");
    for (std::size_t i = 0; i < points.points.count; ++i)
      ASSERT_LT(misfit(points.world(i)), 2e-4);  // 16 bits of a node's box of 20
  }
}

TEST_F(Simulate, TheStatueOfTheProjectBuildsAndIsProved) {
  const Outcome made = simulate({CAIRN_SOURCE "/configs/scenes/statue.toml", "--points", "50000"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("south_east.ply"));
  const std::string config = campaign() + "/campaign.toml";
  ASSERT_EQ(cairn({"build", config, "--progress", "none", "--node-points", "4096"}).exit_code, 0);
  EXPECT_NEAR(info().at("points").get<double>(), 50000, 2500);
  EXPECT_EQ(cairn({"verify", output(), "--progress", "none", "--against", config}).exit_code, 0);
}

TEST_F(Simulate, TheSameBytesOnAnyNumberOfThreads) {
  ASSERT_EQ(simulate({scene(), "--threads", "1", "--points", "60000"}).exit_code, 0);
  const auto once = contents();
  EXPECT_EQ(once.size(), 4U);
  for (const std::string threads : {"1", "2", "7"}) {
    ASSERT_EQ(simulate({scene(), "--threads", threads, "--points", "60000", "--force"}).exit_code,
              0);
    EXPECT_TRUE(contents() == once) << threads;
  }
}

TEST_F(Simulate, ReportsEveryStationAsJson) {
  const Outcome outcome = simulate({scene(), "--json"});
  const auto report = nlohmann::json::parse(outcome.out, nullptr, false);
  ASSERT_EQ(report.at("stations").size(), 2U);
  const auto& station = report.at("stations").at(0);
  EXPECT_EQ(station.at("file"), "first.ply");
  EXPECT_EQ(station.at("rays"), 300 * 150);
  EXPECT_EQ(station.at("points"), read_points(folder_ / "site/first.ply").points.count);
  EXPECT_EQ(station.at("bytes"), std::filesystem::file_size(folder_ / "site/first.ply"));
  EXPECT_EQ(report.at("points"),
            station.at("points").get<int>() + report.at("stations").at(1).at("points").get<int>());
}

/// The scene with a crown of foliage before it, and effects.
const std::string kEffects = R"(
[[object]]
type = "sphere"
position = [430998.0, 5809998.0, 54.0]
radius = 1.2
leaf_area_density = 1.5
[effects.foliage]
returns = 4
[effects.registration_error]
translation = 0.5
rotation = 0.1
)";

TEST_F(Simulate, TellsCallsOfTheNamedEffectsAndNoneOfOthers) {
  const auto calls = [&](const std::string& text) -> nlohmann::json {
    const Outcome outcome = simulate({scene(text), "--json", "--force"});
    return nlohmann::json::parse(outcome.out, nullptr, false).at("effect_calls");
  };
  const auto none = calls(kScene), some = calls(kScene + kEffects);
  for (const auto& [name, count] : none.items()) EXPECT_EQ(count, 0) << name;
  for (const auto& [name, count] : some.items())
    EXPECT_EQ(count, name == "foliage" ? 90'000 : name == "registration_error" ? 2 : 0) << name;
  EXPECT_THAT(
      simulate({scene(kScene + kEffects), "--force"}).out,
      ContainsRegex("effect registration_error +2 calls\n  effect foliage +90,000 calls\n"));
}

TEST_F(Simulate, AMisplacedCampaignWithSeveralReturnsIsBuiltAndProved) {
  for (const std::string frame : {"sensor", "world"})
    for (const std::string format : {"ply", "las"}) {
      const std::string text = "[output]\nframe = \"" + frame + "\"\n" + kScene + kEffects;
      ASSERT_EQ(simulate({scene(text), "--format", format, "--force"}).exit_code, 0);
      const formats::PoseFile poses(folder_ / "site/poses.tsv");
      const double told = poses.find(folder_ / ("site/first." + format)).pose.translation[0];
      EXPECT_NE(told, 431000);
      EXPECT_NEAR(told, 431000, 4 * 0.5);
      const std::string config = campaign() + "/campaign.toml";
      ASSERT_EQ(cairn({"build", config, "--progress", "none", "--force"}).exit_code, 0);
      EXPECT_EQ(cairn({"verify", output(), "--progress", "none", "--against", config}).exit_code,
                0);
    }
}

TEST_F(Simulate, KeepsWhatIsThereUnlessForced) {
  ASSERT_EQ(simulate({scene()}).exit_code, 0);
  const auto before = contents();
  expect_refusal(simulate({scene(), "--points", "1000"}), 2);
  EXPECT_TRUE(contents() == before);
  EXPECT_EQ(simulate({scene(), "--points", "1000", "--format", "las", "--force"}).exit_code, 0);
  EXPECT_EQ(files_of(".ply").size(), 0U);
  EXPECT_EQ(files_of(".las").size(), 2U);
  folder_.write("site/thesis.txt", "mine");
  expect_refusal(simulate({scene(), "--force"}), 2);
  EXPECT_EQ(read_text(folder_ / "site/thesis.txt"), "mine");
}

TEST_F(Simulate, ReplacesOnlyWhatItMadeItself) {
  // A campaign that someone wrote by hand, of files named like those of simulate.
  for (const char* name : {"a.ply", "b.ply", "poses.tsv"})
    write_text(folder_ / "site" / name, "mine");
  write_text(folder_ / "site/campaign.toml",
             "scans = [\"a.ply\", \"b.ply\"]\nposes = \"poses.tsv\"\n");
  const Outcome outcome = simulate({scene(), "--force"});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err, HasSubstr("that simulate did not make"));
  EXPECT_EQ(read_text(folder_ / "site/a.ply"), "mine");
  std::filesystem::remove_all(campaign());
  // Things that were put into a folder of simulate's, under names like those of scans.
  ASSERT_EQ(simulate({scene()}).exit_code, 0);
  for (const std::string place : {"sub.ply/thesis.txt", "other.ply"}) {
    write_text(folder_ / "site" / place, "mine");
    const Outcome refused = simulate({scene(), "--force"});
    expect_refusal(refused, 2);
    EXPECT_EQ(read_text(folder_ / "site" / place), "mine");
    std::filesystem::remove_all(std::filesystem::path(campaign()) /
                                place.substr(0, place.find('/')));
  }
  std::filesystem::rename(folder_ / "site/first.ply", folder_ / "first.ply");
  write_text(folder_ / "site/first.ply/thesis.txt", "mine");
  expect_refusal(simulate({scene(), "--force"}), 2);
  EXPECT_EQ(read_text(folder_ / "site/first.ply/thesis.txt"), "mine");
}

TEST_F(Simulate, AFolderMayHaveAnyName) {
  const std::string folder = folder_ / "a \"site\" \\ more";
  ASSERT_EQ(cairn({"simulate", scene(), "--progress", "none", "-o", folder + "/"}).exit_code, 0);
  const Outcome built = cairn({"build", folder + "/campaign.toml", "--progress", "none"});
  EXPECT_EQ(built.exit_code, 0) << built.err;
  EXPECT_TRUE(std::filesystem::exists(folder + ".cairn/index.bin"));
}

TEST_F(Simulate, NoControlCharactersOfANameReachTheTerminal) {
  const Outcome made =
      cairn({"simulate", scene(), "--progress", "none", "-o", folder_ / "\x1b[31mred"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.out.find('\x1b'), std::string::npos) << made.out;
  EXPECT_THAT(made.out, HasSubstr("?[31mred/campaign.toml"));
}

TEST_F(Simulate, RefusesWhatCannotBe) {
  expect_nothing_made(simulate({folder_ / "none.toml"}), 4);
  expect_nothing_made(simulate({scene(), "--points", "0"}), 2);
  expect_nothing_made(simulate({scene(), "--format", "e57"}), 2);
  expect_nothing_made(simulate({scene("nonsense = 1\n" + kScene)}), 2);
  const std::string alone =
      kScene + "[[station]]\nname = \"alone\"\nposition = [0, 0, 0]\nstep = 9\n";
  const Outcome outcome = simulate({scene(alone)});
  expect_nothing_made(outcome, 3);
  EXPECT_THAT(outcome.err, HasSubstr("no ray of alone hits anything"));
}

}  // namespace
}  // namespace cairn::test
