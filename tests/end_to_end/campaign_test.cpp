// The real campaigns of the shared data, by the campaign files that the project ships.
#include "tests/end_to_end/program_test.h"
#include "tests/support/manifest.h"
#include "tests/support/shared_data.h"

namespace cairn::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Campaign : public ProgramTest {
 protected:
  static std::string file(const std::string& name) {
    return CAIRN_SOURCE "/configs/campaigns/" + name + ".toml";
  }
  static std::string folder_of(const std::string& name) {
    return CAIRN_SHARED_DATA "/campaign_" + name;
  }

  /// What the manifest counts in the scans of a campaign whose paths hold `part`.
  static std::uint64_t counted(const std::string& name, const std::string& part) {
    std::uint64_t points = 0;
    for (const ManifestEntry& entry : read_manifest(CAIRN_SHARED_DATA "/MANIFEST.tsv"))
      if (entry.path.starts_with("campaign_" + name + "/") &&
          entry.path.find(part) != std::string::npos)
        points += entry.points.value_or(0);
    return points;
  }

  void expect_built_and_proved(const std::string& name, std::uint64_t points) {
    expect_built_and_proved(name, name, points);
  }

  /// Where the campaign's scans lie in the folder of another.
  void expect_built_and_proved(const std::string& name, const std::string& data,
                               std::uint64_t points) {
    SCOPED_TRACE(name);
    const Outcome built = build({file(name), "--folder", folder_of(data)});
    ASSERT_EQ(built.exit_code, 0) << built.err;
    EXPECT_GT(points, 0U);
    EXPECT_EQ(info().at("points"), points);
    EXPECT_EQ(info().at("dropped"), 0);
    EXPECT_EQ(info().at("missing"), 0);
    const Outcome verified = cairn({"verify", "--progress", "none", output(), "--against",
                                    file(name), "--folder", folder_of(data)});
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  }
};

TEST_F(Campaign, BunnyIsBuiltAndProved) {
  CAIRN_NEEDS_SHARED_DATA();
  expect_built_and_proved("bunny", counted("bunny", ".ply"));
}

TEST_F(Campaign, LivoxIsBuiltAndProvedWithSensorsFromPoses) {
  CAIRN_NEEDS_SHARED_DATA();
  expect_built_and_proved("livox", counted("livox", ".laz"));
}

TEST_F(Campaign, PlotOfThreeSensorsIsBuiltAndProved) {
  CAIRN_NEEDS_SHARED_DATA();
  expect_built_and_proved("plot", counted("plot", ".laz") - counted("plot", "TLS_Clip"));
}

TEST_F(Campaign, AScanInAnotherFrameIsRefusedByName) {
  CAIRN_NEEDS_SHARED_DATA();
  std::vector<std::string> scans;
  for (const auto& scan : files_in(folder_of("plot"), ".laz")) scans.push_back(scan);
  const Outcome outcome = build(scans);
  expect_refusal(outcome, 3);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("TLS_Clip.laz"), HasSubstr("apart from the others")));
}

using LongCampaign = Campaign;

TEST_F(LongCampaign, AirborneSurveysAreBuiltAndProved) {
  CAIRN_NEEDS_SHARED_DATA();
  expect_built_and_proved("autzen", counted("autzen", ".laz"));
  std::filesystem::remove_all(output());
  expect_built_and_proved("bcts", counted("bcts", ".laz"));
}

TEST_F(LongCampaign, LivoxScansInE57StandBesideTheOthers) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::uint64_t points = counted("livox", ".laz") + counted("livox", ".e57");
  expect_built_and_proved("livox_posed", "livox", points);
  EXPECT_EQ(info().at("sources").size(), 11U);
}

}  // namespace
}  // namespace cairn::test
