// What measure finds agrees with what the build recorded, and a broken bound is told.
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

}  // namespace
}  // namespace cairn::test
