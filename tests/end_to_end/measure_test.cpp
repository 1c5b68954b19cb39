// What measure finds agrees with what the build recorded, and a broken bound is told.
#include <cmath>

#include "tests/end_to_end/program_test.h"
#include "tests/support/las_bytes.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

class Measure : public ProgramTest {
 protected:
  Outcome measure(std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"measure", output(), "--progress", "none"});
    return cairn(std::move(flags));
  }
};

TEST_F(Measure, AgreesWithWhatTheBuildRecorded) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  const Json told = info(), measured = Json::parse(measure({"--json"}).out);
  EXPECT_EQ(measured["held"], true);
  EXPECT_EQ(measured["leaf_points"], 5000);
  ASSERT_EQ(measured["levels"].size() + 1, told["levels"].size());
  for (std::size_t i = 0; i < measured["levels"].size(); ++i) {
    const Json &level = measured["levels"][i], &recorded = told["levels"][i];
    EXPECT_EQ(level["bound"], recorded["bound"]);
    EXPECT_LE(level["largest"], recorded["bound"]);
    EXPECT_LE(level["percentile_99"], level["largest"]);
    EXPECT_LE(level["rms"], level["percentile_99"]);
    // The build sums up exact means, the dataset holds them quantised to 16 bits of a node's box.
    EXPECT_NEAR(level["rms"].get<double>() / recorded["rms"].get<double>(), 1, 1e-3);
  }
}

TEST_F(Measure, TellsALevelALineWithItsAttributes) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  const Outcome outcome = measure({});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* part : {"5,000 leaf points", "99 % within", "bound / largest", "intensity"})
    EXPECT_THAT(outcome.out, HasSubstr(part));
}

TEST_F(Measure, ABrokenBoundIsToldAndEndsWithItsCode) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  edit_index(output(), [](formats::DatasetIndex& index) { index.nodes[0].bound /= 8; });
  const Outcome outcome = measure({});
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_THAT(outcome.out, HasSubstr("BROKEN"));
  EXPECT_THAT(lines_of(outcome.err),
              testing::ElementsAre(HasSubstr("farther from those that stand for them")));
}

TEST_F(Measure, OfAllPointsTheNearestIsNoFartherThanTheOneThatStandsForThem) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  const Json measured = Json::parse(measure({"--json", "--sample", "all"}).out);
  for (const Json& level : measured["levels"]) {
    const Json& surface = level["geometry"]["surface"];
    EXPECT_EQ(surface["sampled"], 5000);
    EXPECT_LE(surface["nearest"]["rms"], level["rms"]);
    EXPECT_LE(surface["nearest"]["largest"], level["largest"]);
    EXPECT_TRUE(surface["nearest"]["rms_interval"].is_null());
    EXPECT_GT(level["geometry"]["spacing"]["mean"], 0);
    EXPECT_TRUE(level["geometry"]["truth"].is_null());
  }
  EXPECT_TRUE(measured["leaves"]["surface"].is_null());
  EXPECT_GT(measured["leaves"]["spacing"]["mean"], 0);
}

TEST_F(Measure, ASampleIsToldWithTheRangesOfItsFigures) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  const Json level =
      Json::parse(measure({"--json", "--sample", "1k"}).out)["levels"][0]["geometry"]["surface"];
  EXPECT_NEAR(level["sampled"].get<double>(), 1000, 150);
  EXPECT_LT(level["nearest"]["rms_interval"][0], level["nearest"]["rms"]);
  EXPECT_GT(level["nearest"]["rms_interval"][1], level["nearest"]["rms"]);
  const std::string text = measure({"--sample", "1k"}).out;
  for (const char* part : {"points of the leaves searched for", "95 % certain", "overdraw"})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_THAT(measure({"--sample", "none"}).out, testing::Not(HasSubstr("overdraw")));
}

TEST_F(Measure, AgainstItsScansItTellsWhatQuantisationMoved) {
  const std::string scan = write_wavy_las(folder_ / "a.las", 5000);
  ASSERT_EQ(build({scan, "--node-points", "300", "--position-bits", "6"}).exit_code, 0);
  const Json measured = Json::parse(measure({"--json", "--sample", "all", "--against", scan}).out);
  const Json& leaves = measured["leaves"]["surface"];
  EXPECT_EQ(leaves["sampled"], 5000);
  EXPECT_GT(leaves["nearest"]["largest"], 0);
  EXPECT_LE(leaves["nearest"]["largest"], measured["leaf_displacement"]);

  ASSERT_EQ(build({scan, "--node-points", "300", "--lossless-leaves", "--force"}).exit_code, 0);
  const Json kept = Json::parse(measure({"--json", "--against", scan}).out);
  EXPECT_EQ(kept["leaves"]["surface"]["nearest"]["largest"], 0);
}

TEST_F(Measure, AgainstItsScansPointsThatEffectsRemovedCount) {
  const std::string scan = write_wavy_las(folder_ / "a.las", 5000);
  ASSERT_EQ(build({scan, "--node-points", "300", "--lossless-leaves", "--thin", "50"}).exit_code,
            0);
  const Json measured = Json::parse(measure({"--json", "--sample", "all", "--against", scan}).out);
  EXPECT_LT(measured["leaf_points"], 5000);
  EXPECT_EQ(measured["leaves"]["surface"]["sampled"], 5000);
  // What was removed has a kept point in its cell, so within the cell's diagonal.
  EXPECT_GT(measured["leaves"]["surface"]["nearest"]["largest"], 0);
  EXPECT_LE(measured["leaves"]["surface"]["nearest"]["largest"], 50 * std::sqrt(3.0));

  const Json some = Json::parse(measure({"--json", "--sample", "500", "--against", scan}).out);
  EXPECT_NEAR(some["leaves"]["surface"]["sampled"].get<double>(), 500, 5 * std::sqrt(500));
}

TEST_F(Measure, AgainstItsSceneItTellsHowFarPointsAreFromTheTrueSurface) {
  const std::string scene = folder_.write("scene.toml", R"toml(
[[object]]
type = "sphere"
radius = 2.0
[[station]]
position = [5.0, 0.0, 0.0]
counts = [1600, 500]
)toml");
  const Outcome made = cairn({"simulate", scene, "-o", folder_ / "ball", "--progress", "none"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  ASSERT_EQ(build({folder_ / "ball/campaign.toml", "--node-points", "200"}).exit_code, 0);
  const Json measured = Json::parse(measure({"--json", "--sample", "all", "--scene", scene}).out);
  EXPECT_LT(measured["leaves"]["truth"]["largest"], 1e-3);
  // Means of points of a ball's skin lie inside it; those that stand for more lie deeper.
  double before = 1;
  for (const Json& level : measured["levels"]) {
    const double rms = level["geometry"]["truth"]["rms"];
    EXPECT_LT(rms, before);
    EXPECT_GT(rms, measured["leaves"]["truth"]["rms"]);
    before = rms;
  }
}

TEST_F(Measure, RefusesASampleOfNoNumberAndComparisonsWithNone) {
  const std::string scan = write_wavy_las(folder_ / "a.las", 500);
  ASSERT_EQ(build({scan}).exit_code, 0);
  for (const std::vector<std::string>& flags : {std::vector<std::string>{"--sample", "many"},
                                                {"--sample", "99"},
                                                {"--sample", "none", "--against", scan},
                                                {"--columns", "x y z"}}) {
    const Outcome outcome = measure(flags);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  }
}

}  // namespace
}  // namespace cairn::test
