#include "pipeline/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/error.h"
#include "pipeline/compiled_in.h"
#include "pipeline/config.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kMinimum = "scans = \"a.las\"\noutput = \"a.cairn\"\n";

class Settings : public ::testing::Test {
 protected:
  BuildSettings resolve(const std::string& text, const SettingLayer& flags = {}) {
    test::write_text(folder_ / "site.toml", text);
    return resolve_settings(flags, folder_ / "site.toml");
  }

  /// The message of the usage error that the text gives; empty if it gives none.
  std::string refusal(const std::string& text, const SettingLayer& flags = {}) {
    try {
      resolve(text, flags);
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
      return error.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
};

SettingLayer flag(const std::string& key, std::vector<std::string> values) {
  return {{key, {std::move(values), find_setting(key)->flag()}}};
}

TEST_F(Settings, DefaultsAreTheDesigns) {
  const BuildOptions options = resolve(kMinimum).options;
  EXPECT_EQ(options.fanout, std::nullopt);
  EXPECT_EQ(options.node_points, 65536U);
  EXPECT_EQ(options.grid, std::nullopt);
  EXPECT_EQ(options.theta_degrees, 15);
  EXPECT_EQ(options.theta_relaxation, 1.5);
  EXPECT_EQ(options.refinement, 2U);
  EXPECT_EQ(options.reducer, "cluster");
  EXPECT_EQ(options.position_bits, 16);
  EXPECT_EQ(options.codec, formats::Codec::kLzo);
  EXPECT_FALSE(options.lossless_leaves || options.campaign.allow_truncated || options.force);
}

TEST_F(Settings, TakesEveryKey) {
  const BuildSettings settings = resolve(R"(
scans = ["a.las", "/b.ply"]
output = "out.cairn"
preset = "preview"
drop = ["color", "gps_time"]
resolution = 0.001
allow_truncated = true
columns = "x y z intensity"
fanout = 6
node_points = 1000
reducer = "first"
grid = 40
theta = 20
theta_relaxation = 2.5
refinement = 3
position_bits = 20
lossless_leaves = true
codec = "zstd"
memory = "1GiB"
threads = 3
scratch = "tmp"
progress = "json"
)");
  const BuildOptions& options = settings.options;
  EXPECT_THAT(options.campaign.scans, ElementsAre(folder_ / "a.las", "/b.ply"));
  EXPECT_EQ(options.output, folder_ / "out.cairn");
  EXPECT_THAT(options.drop, ElementsAre("color", "gps_time"));
  EXPECT_EQ(options.resolution, 0.001);
  EXPECT_TRUE(options.campaign.allow_truncated);
  EXPECT_THAT(options.campaign.columns, ElementsAre("x", "y", "z", "intensity"));
  EXPECT_EQ(options.fanout, 6U);
  EXPECT_EQ(options.node_points, 1000U);
  EXPECT_EQ(options.reducer, "first");
  EXPECT_EQ(options.grid, 40U);
  EXPECT_EQ(options.theta_degrees, 20);
  EXPECT_EQ(options.theta_relaxation, 2.5);
  EXPECT_EQ(options.refinement, 3U);
  EXPECT_EQ(options.position_bits, 20);
  EXPECT_TRUE(options.lossless_leaves);
  EXPECT_EQ(options.codec, formats::Codec::kZstd);
  EXPECT_EQ(options.memory_bytes, std::uint64_t{1} << 30);
  EXPECT_EQ(options.threads, 3U);
  EXPECT_EQ(options.scratch, folder_ / "tmp");
  EXPECT_EQ(settings.progress, ProgressMode::kJson);
}

TEST_F(Settings, FlagsWinOverConfigurationOverPreset) {
  const std::string text = std::string(kMinimum) + "preset = \"preview\"\nfanout = 4\n";
  EXPECT_EQ(resolve(text).options.refinement, 0U);
  EXPECT_EQ(resolve(text, flag("refinement", {"5"})).options.refinement, 5U);
  EXPECT_EQ(resolve(text, flag("fanout", {"8"})).options.fanout, 8U);
  EXPECT_EQ(resolve(text, flag("fanout", {"auto"})).options.fanout, std::nullopt);
  EXPECT_EQ(resolve(text, flag("preset", {"archive"})).options.refinement, 2U);
  EXPECT_EQ(resolve(text + "refinement = 3\n").options.refinement, 3U);
}

TEST_F(Settings, FlagsAreNotRelativeToTheConfiguration) {
  EXPECT_EQ(resolve(kMinimum, flag("output", {"b.cairn"})).options.output, "b.cairn");
}

TEST_F(Settings, ScansAndPosesStartFromTheFolderThatIsGiven) {
  const std::string text = std::string(kMinimum) + "poses = \"p.tsv\"\n";
  EXPECT_EQ(resolve(text).options.campaign.poses, folder_ / "p.tsv");
  const test::TemporaryFolder data;
  const BuildOptions moved = resolve(text, flag("folder", {data.path()})).options;
  EXPECT_THAT(moved.campaign.scans, ElementsAre(data / "a.las"));
  EXPECT_EQ(moved.campaign.poses, data / "p.tsv");
  EXPECT_EQ(moved.output, folder_ / "a.cairn");
  // In a file the folder itself starts from the file's.
  std::filesystem::create_directory(folder_ / "scans");
  EXPECT_THAT(resolve(text + "folder = \"scans\"\n").options.campaign.scans,
              ElementsAre(folder_ / "scans/a.las"));
}

TEST_F(Settings, APatternStandsForTheFilesThatMatchInTheOrderOfTheirBytes) {
  for (const char* name : {"b10.las", "b2.las", "B1.las", "c.las"}) folder_.write(name, "");
  const std::string text = "output = \"a.cairn\"\nscans = [\"c.las\", \"[bB]*.las\"]\n";
  EXPECT_THAT(
      resolve(text).options.campaign.scans,
      ElementsAre(folder_ / "c.las", folder_ / "B1.las", folder_ / "b10.las", folder_ / "b2.las"));
  try {
    resolve("output = \"a.cairn\"\nscans = [\"*.none\"]\n");
    ADD_FAILURE() << "not refused";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("*.none"));
  }
}

TEST_F(Settings, APatternIsWhatTheFileSaysAndNotWhereItLies) {
  for (const char* place : {"d[1]", "d*?", "d\\1"}) {
    test::write_text(folder_ / place / "a.las", "");
    test::write_text(folder_ / place / "site.toml",
                     "output = \"a.cairn\"\nscans = [\"*.las\", \"none.ply\"]\n");
    EXPECT_THAT(resolve_settings({}, folder_ / place / "site.toml").options.campaign.scans,
                ElementsAre(folder_ / place / "a.las", folder_ / place / "none.ply"));
  }
}

TEST_F(Settings, AFolderThatIsNotThereIsToldAsThat) {
  folder_.write("a.las", "");
  const std::string text = "output = \"a.cairn\"\nscans = [\"*.las\"]\n";
  EXPECT_THAT(
      refusal(text + "folder = \"none\"\n"),
      AllOf(HasSubstr("site.toml, line 3: folder: found no folder at '"), HasSubstr("none'")));
  EXPECT_THAT(refusal(text, flag("folder", {folder_ / "a.las"})),
              AllOf(HasSubstr("--folder: found no folder at '"), HasSubstr("a.las'")));
}

TEST_F(Settings, PatternsThatOverlapListAFileOnce) {
  for (const char* name : {"a.las", "b.las", "c.las"}) folder_.write(name, "");
  const auto scans = [&](const std::string& list) {
    return resolve("output = \"a.cairn\"\nscans = [" + list + "]\n").options.campaign.scans;
  };
  const auto each_once = ElementsAre(folder_ / "b.las", folder_ / "a.las", folder_ / "c.las");
  EXPECT_THAT(scans(R"("b.las", "*.las")"), each_once);
  EXPECT_THAT(scans(R"("[b].las", "b.las", "*.las", "./*.las")"), each_once);
  // Named twice, it is a mistake that whoever opens the scans tells.
  EXPECT_EQ(scans(R"("b.las", "b.las")").size(), 2U);
}

TEST_F(Settings, KeepAndDropTogetherAreRefused) {
  EXPECT_THROW(resolve(std::string(kMinimum) + "keep = [\"color\"]\ndrop = [\"normal\"]\n"),
               formats::Error);
}

TEST_F(Settings, SpellsColourBothWays) {
  EXPECT_THAT(resolve(kMinimum, flag("drop", {"colour"})).options.drop, ElementsAre("color"));
}

TEST_F(Settings, AnEmptyListOverridesALongerOne) {
  EXPECT_THAT(resolve(std::string(kMinimum) + "drop = []").options.drop, IsEmpty());
}

struct BadValue {
  const char* text;
  const char* key;
  const char* found;
  const char* allowed;
};
void PrintTo(const BadValue& bad, std::ostream* out) { *out << bad.text; }

class BadValues : public Settings, public ::testing::WithParamInterface<BadValue> {};

TEST_P(BadValues, AreRefusedWithFileLineKeyAndWhatIsAllowed) {
  const BadValue& bad = GetParam();
  EXPECT_THAT(refusal(std::string(kMinimum) + bad.text),
              AllOf(HasSubstr("site.toml, line 3: "), HasSubstr(bad.key), HasSubstr(bad.found),
                    HasSubstr(bad.allowed)));
}

INSTANTIATE_TEST_SUITE_P(
    Types, BadValues,
    ::testing::Values(
        BadValue{"fanout = \"6\"", "fanout", "the string \"6\"",
                 "an integer from 2 to 64, or auto"},
        BadValue{"fanout = 4.0", "fanout", "4", "an integer from 2 to 64"},
        BadValue{"node_points = true", "node_points", "true", "an integer from 2"},
        BadValue{"theta = \"wide\"", "theta", "the string \"wide\"", "a number from 0 to 180"},
        BadValue{"reducer = 3", "reducer", "3",
                 "a string: cluster, average, weighted, first or random"},
        BadValue{"lossless_leaves = 1", "lossless_leaves", "1", "true or false"},
        BadValue{"lossless_leaves = \"yes\"", "lossless_leaves", "\"yes\"", "true or false"},
        BadValue{"drop = 3", "drop", "3", "an array of strings"},
        BadValue{"drop = [\"color\", 3]", "drop", "3", "an array of strings"},
        BadValue{"memory = 1.5", "memory", "1.5", "a size of at least 64MiB"},
        BadValue{"memory = []", "memory", "[]", "a size of at least 64MiB"},
        BadValue{"scratch = 1979-05-27", "scratch", "a date or time", "a path of a folder"},
        BadValue{"threads = {}", "threads", "a table", "an integer from 1 to 1024"}));

INSTANTIATE_TEST_SUITE_P(
    Ranges, BadValues,
    ::testing::Values(
        BadValue{"fanout = 1", "fanout", "1", "an integer from 2 to 64"},
        BadValue{"fanout = 65", "fanout", "65", "an integer from 2 to 64"},
        BadValue{"fanout = -4", "fanout", "-4", "an integer from 2 to 64"},
        BadValue{"node_points = 1", "node_points", "1", "an integer from 2 to 2097152"},
        BadValue{"node_points = 9223372036854775807", "node_points", "9223372036854775807",
                 "an integer from 2 to 2097152"},
        BadValue{"grid = 0", "grid", "0", "an integer from 1 to 65536"},
        BadValue{"theta = -1", "theta", "-1", "a number from 0 to 180"},
        BadValue{"theta = 180.5", "theta", "180.5", "a number from 0 to 180"},
        BadValue{"theta = nan", "theta", "nan", "a number from 0 to 180"},
        BadValue{"theta_relaxation = 1.0", "theta_relaxation", "1", "a number above 1"},
        BadValue{"theta_relaxation = inf", "theta_relaxation", "inf", "a number above 1"},
        BadValue{"position_bits = 0", "position_bits", "0", "an integer from 1 to 32"},
        BadValue{"position_bits = 33", "position_bits", "33", "an integer from 1 to 32"},
        BadValue{"resolution = 0", "resolution", "0", "a number above 0"},
        BadValue{"thin = 0", "thin", "0", "a number above 0"},
        BadValue{"outlier_deviations = -1", "outlier_deviations", "-1", "a number from 0"},
        BadValue{"outlier_neighbors = 0", "outlier_neighbors", "0", "an integer from 1 to 1024"},
        BadValue{"remove_duplicates = \"all\"", "remove_duplicates", "all",
                 "none, position or exact"},
        BadValue{"reducer = \"best\"", "reducer", "best",
                 "cluster, average, weighted, first or random"},
        BadValue{"codec = \"LZO\"", "codec", "LZO", "none, lzo, lzo999 or zstd"},
        BadValue{"preset = \"fast\"", "preset", "fast", "default, preview or archive"},
        BadValue{"memory = \"1KiB\"", "memory", "1KiB", "a size of at least 64MiB"},
        BadValue{"memory = \"110%\"", "memory", "110%", "a share such as 50%"},
        BadValue{"memory = 1000", "memory", "1000", "a size of at least 64MiB"},
        BadValue{"threads = 0", "threads", "0", "an integer from 1 to 1024"},
        BadValue{"scratch = \"\"", "scratch", "''", "a path of a folder"},
        BadValue{"drop = [\"position\"]", "drop", "position", "names of attributes"},
        BadValue{"progress = \"loud\"", "progress", "loud", "auto, bar, plain, json or none"}));

TEST_F(Settings, RefusesBadFlagsByTheirName) {
  EXPECT_THAT(refusal(kMinimum, flag("node_points", {"many"})),
              HasSubstr("--node-points: found 'many', expected an integer from 2 to 2097152"));
}

TEST_F(Settings, SuggestsTheNearestKey) {
  EXPECT_THAT(refusal(std::string(kMinimum) + "fan_out = 4"),
              AllOf(HasSubstr("site.toml, line 3"), HasSubstr("'fan_out'"),
                    HasSubstr("did you mean 'fanout'")));
  EXPECT_THAT(refusal(std::string(kMinimum) + "node-points = 4"),
              HasSubstr("did you mean 'node_points'"));
  EXPECT_THAT(refusal(std::string(kMinimum) + "[build]\nfanout = 4"),
              HasSubstr("unknown key 'build'"));
  EXPECT_THAT(refusal(std::string(kMinimum) + "zzzzzzzzzzzz = 4"),
              HasSubstr("keys are scans, folder, output, preset"));
}

TEST_F(Settings, ForceIsAFlagOnly) {
  EXPECT_THAT(refusal(std::string(kMinimum) + "force = true"),
              HasSubstr("'force' is a flag only: --force"));
}

TEST_F(Settings, NamesTheLineOfBrokenToml) {
  EXPECT_THAT(refusal(std::string(kMinimum) + "fanout = = 4"), HasSubstr("site.toml, line 3: "));
  EXPECT_THAT(refusal(std::string(kMinimum) + "fanout = 4\nfanout = 5"),
              HasSubstr("site.toml, line 4: "));
}

TEST_F(Settings, RefusesKeysThatNestSoDeepThatTheParserWouldOverflow) {
  std::string deep = "a";
  for (int i = 0; i < 1000; ++i) deep += ".a";
  EXPECT_THAT(refusal(deep + " = 1"), HasSubstr("unknown key 'a'"));
  for (int i = 0; i < 99'000; ++i) deep += ".a";
  const auto too_deep = AllOf(HasSubstr("line 2 has too many dots"), HasSubstr("found 100000"),
                              HasSubstr("at most 1000"));
  EXPECT_THAT(refusal("\n" + deep + " = 1"), too_deep);
  EXPECT_THAT(refusal("\n[" + deep + "]\n"), too_deep);
}

TEST_F(Settings, NeedsScansAndAnOutput) {
  EXPECT_THAT(refusal("output = \"a.cairn\""), HasSubstr("no scans"));
  EXPECT_THAT(refusal("scans = []\noutput = \"a.cairn\""), HasSubstr("no scans"));
  EXPECT_THAT(refusal("scans = [\"a.las\"]"), HasSubstr("no output"));
}

TEST_F(Settings, NeedsAsManyPointsAsChildren) {
  EXPECT_THAT(refusal(std::string(kMinimum) + "fanout = 8\nnode_points = 7"),
              HasSubstr("less than the fan-out 8"));
  EXPECT_EQ(resolve(std::string(kMinimum) + "fanout = 8\nnode_points = 8").options.node_points, 8U);
}

TEST_F(Settings, AMissingConfigurationIsASystemError) {
  try {
    resolve_settings({}, folder_ / "none.toml");
    FAIL() << "no error";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_THAT(error.what(), HasSubstr("none.toml"));
  }
}

TEST_F(Settings, EveryPresetHoldsAndTheDefaultOneChangesNothing) {
  ASSERT_EQ(presets().size(), 3U);
  const std::string unset = kMinimum;
  for (const Preset& preset : presets())
    EXPECT_EQ(refusal(unset + "preset = \"" + std::string(preset.name) + "\""), "") << preset.name;
  const BuildOptions plain = resolve(unset).options;
  const BuildOptions preset = resolve(unset + "preset = \"default\"").options;
  EXPECT_EQ(preset.fanout, plain.fanout);
  EXPECT_EQ(preset.node_points, plain.node_points);
  EXPECT_EQ(preset.grid, plain.grid);
  EXPECT_EQ(preset.theta_degrees, plain.theta_degrees);
  EXPECT_EQ(preset.theta_relaxation, plain.theta_relaxation);
  EXPECT_EQ(preset.refinement, plain.refinement);
  EXPECT_EQ(preset.reducer, plain.reducer);
  EXPECT_EQ(preset.position_bits, plain.position_bits);
  EXPECT_EQ(preset.lossless_leaves, plain.lossless_leaves);
  EXPECT_EQ(preset.codec, plain.codec);
}

TEST_F(Settings, EffectsAreOffUntilTheyAreNamed) {
  EXPECT_FALSE(resolve(kMinimum).options.filter.any());
  EXPECT_FALSE(resolve(std::string(kMinimum) + "outlier_neighbors = 20").options.filter.any());
  const stages::FilterOptions filter =
      resolve(std::string(kMinimum) +
              "remove_duplicates = \"exact\"\noutlier_deviations = 2\noutlier_neighbors = 20\n"
              "balance_exposure = true\nthin = 0.5")
          .options.filter;
  EXPECT_EQ(filter.duplicates, stages::Duplicates::kExact);
  EXPECT_EQ(filter.outlier_deviations, 2);
  EXPECT_EQ(filter.outlier_neighbors, 20U);
  EXPECT_TRUE(filter.balance_exposure);
  EXPECT_EQ(filter.thin, 0.5);
}

TEST_F(Settings, ArchiveKeepsTheLeaves) {
  EXPECT_TRUE(resolve(std::string(kMinimum) + "preset = \"archive\"").options.lossless_leaves);
}

TEST(SettingsTable, IsTheReadmes) {
  const std::string readme = test::read_text(CAIRN_SOURCE "/README.md");
  std::istringstream rows(settings_markdown());
  for (std::string row; std::getline(rows, row);) EXPECT_THAT(readme, HasSubstr(row + "\n"));
}

}  // namespace
}  // namespace cairn::pipeline
