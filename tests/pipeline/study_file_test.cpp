// Study files: the settings that a sweep expands to, and how wrong studies are refused.
#include "pipeline/study/study_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/error.h"
#include "tests/support/shared_data.h"

namespace cairn::pipeline {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kInput = "[[input]]\nname = \"a\"\nscans = [\"a.las\"]\n";

std::vector<std::string> labels(const std::string& text) {
  std::vector<std::string> all;
  for (const StudySetting& setting : parse_study(kInput + text, "some/study.toml").settings)
    all.push_back(setting.label);
  return all;
}

/// The message in which the text behind three lines of an input is refused.
std::string refusal(const std::string& text) {
  try {
    parse_study(kInput + text, "s.toml");
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    return error.what();
  }
  return "no error";
}

TEST(StudyFile, TheStudiesOfTheProjectAreRead) {
  const auto studies = test::files_in(CAIRN_SOURCE "/configs/studies", ".toml");
  EXPECT_EQ(studies.size(), 4U);
  for (const auto& path : studies) {
    const StudyFile study = read_study(path);
    EXPECT_EQ(study.name, path.stem().string());
    EXPECT_GE(study.settings.size(), 5U) << path;
    for (const StudyInput& input : study.inputs) {
      const auto& described = input.scene ? input.scene : input.campaign;
      EXPECT_TRUE(input.scans || std::filesystem::exists(described.value())) << path;
    }
  }
}

TEST(StudyFile, HasDefaults) {
  const StudyFile study = parse_study(kInput, "some/where.toml");
  EXPECT_EQ(study.name, "where");
  EXPECT_EQ(study.repetitions, 3U);
  EXPECT_EQ(place_words(study.at), "1 level above the leaves");
  ASSERT_EQ(study.inputs.size(), 1U);
  EXPECT_EQ(study.inputs[0].scans->base, "some");
  ASSERT_EQ(study.settings.size(), 1U);
  EXPECT_TRUE(study.settings[0].values.empty());
}

TEST(StudyFile, ASweepIsTheProductOfItsValues) {
  EXPECT_THAT(labels("[sweep]\ntheta = [15, 45.5]\nreducer = [\"cluster\", \"random\"]\ngrid = "
                     "[\"auto\", 64]\n"),
              ElementsAre("cluster, grid auto, theta 15", "cluster, grid auto, theta 45.5",
                          "cluster, grid 64, theta 15", "cluster, grid 64, theta 45.5",
                          "random, grid auto, theta 15", "random, grid auto, theta 45.5",
                          "random, grid 64, theta 15", "random, grid 64, theta 45.5"));
  EXPECT_THAT(labels("[sweep]\nestimate = [[], [\"normals\", \"radii\"]]\nlossless_leaves = "
                     "[true]\n"),
              ElementsAre("estimate none, lossless_leaves true",
                          "estimate normals radii, lossless_leaves true"));
}

TEST(StudyFile, SingleSettingsStandBesideTheProductAndOverTheFixedOnes) {
  const StudyFile study = parse_study(
      kInput +
          "[settings]\nnode_points = 500\nfanout = 3\n[sweep]\ncodec = [\"lzo\", \"zstd\"]\n"
          "[[setting]]\nnode_points = 900\n[[setting]]\nname = \"fast\"\nreducer = \"first\"\n",
      "s.toml");
  ASSERT_EQ(study.settings.size(), 4U);
  EXPECT_EQ(study.settings[0].label, "lzo");
  EXPECT_THAT(study.settings[0].values.at("node_points").values, ElementsAre("500"));
  EXPECT_EQ(study.settings[2].label, "node_points 900");
  EXPECT_THAT(study.settings[2].values.at("node_points").values, ElementsAre("900"));
  EXPECT_THAT(study.settings[2].values.at("fanout").values, ElementsAre("3"));
  EXPECT_FALSE(study.settings[2].values.contains("codec"));
  EXPECT_EQ(study.settings[3].label, "fast");
  EXPECT_THAT(study.settings[3].varied, ElementsAre("reducer"));
}

TEST(StudyFile, RefusalsNameFileLineKeyAndWhatIsAllowed) {
  EXPECT_THAT(refusal("repetition = 3\n"),
              HasSubstr("s.toml, line 4: input 1: unknown key 'repetition'; keys are name, camp"));
  EXPECT_THAT(refusal("[sweeps]\n"), HasSubstr("unknown key 'sweeps'; keys are name, repetitions"));
  EXPECT_EQ(refusal("[sweep]\nteta = [1]\n"),
            "s.toml, line 5: unknown key 'teta'; did you mean 'theta'?");
  EXPECT_EQ(refusal("[sweep]\ntheta = [\n15,\n200]\n"),
            "s.toml, line 7: theta: found '200', expected a number from 0 to 180");
  EXPECT_EQ(refusal("[settings]\ntheta = \"wide\"\n"),
            "s.toml, line 5: theta: found the string \"wide\", expected a number from 0 to 180");
  EXPECT_THAT(refusal("[sweep]\ntheta = 15\n"),
              HasSubstr("line 5: theta: found 15, expected an array"));
  EXPECT_THAT(refusal("[sweep]\ntheta = []\n"), HasSubstr("expected an array"));
  EXPECT_THAT(refusal("[sweep]\nmemory = [\"1GiB\"]\n"), HasSubstr("'memory' tells of resources"));
  EXPECT_THAT(refusal("[settings]\ndrop = [\"color\"]\n"),
              HasSubstr("line 5: 'drop' tells of input and output"));
  EXPECT_THAT(refusal("[settings]\ntheta = 1\n[sweep]\ntheta = [1]\n"),
              HasSubstr("line 7: 'theta' is fixed by [settings]"));
  EXPECT_THAT(refusal("[[setting]]\nname = \"a/b\"\n"), HasSubstr("line 4: name: found"));
}

TEST(StudyFile, EqualSettingsAndInputsAreRefused) {
  EXPECT_THAT(refusal("[sweep]\ntheta = [15, 15.0]\n"), HasSubstr("called 'theta 15'"));
  EXPECT_THAT(refusal("[sweep]\ntheta = [15]\n[[setting]]\nname = \"x\"\ntheta = 15\n"),
              HasSubstr("'theta 15' and 'x' are the same"));
  EXPECT_THAT(refusal(kInput), HasSubstr("line 4: input 2: two inputs have the name a"));
  EXPECT_THAT(refusal("[[input]]\nname = \"b\"\n"), HasSubstr("one of the keys campaign, scans"));
  EXPECT_THAT(refusal("[[input]]\nname = \"b\"\nscene = \"a\"\nscans = [\"a\"]\n"),
              HasSubstr("input 2: expected one of"));
  EXPECT_THAT(refusal("[[input]]\nname = \"b\"\nscans = [\"a\"]\npoints = 9\n"),
              HasSubstr("points asks for a scene"));
}

TEST(StudyFile, PicturesAreReadWithTheirLines) {
  const StudyFile study = parse_study(
      kInput + "[pictures]\nbudgets = [\"200k\", \"1.5M\"]\ndraw = [\"auto\", \"discs\"]\n",
      "s.toml");
  ASSERT_TRUE(study.pictures);
  EXPECT_THAT(study.pictures->budgets, ElementsAre(200'000, 1'500'000));
  EXPECT_EQ(study.pictures->draw_modes.size(), 2U);
  EXPECT_EQ(study.pictures->draw_modes[1], viewer::Primitive::kDiscs);
  EXPECT_THAT(refusal("[pictures]\nbudgets = [200]\n"),
              HasSubstr("line 5: pictures: budgets: found"));
  EXPECT_THAT(refusal("[pictures]\n"), HasSubstr("line 4: pictures: no key 'budgets'"));
  EXPECT_THAT(refusal("[pictures]\nbudgets = [\"1k\"]\ndraw = [\"art\"]\n"),
              HasSubstr("line 6: pictures: draw: found [the string \"art\"], expected"));
  EXPECT_THAT(refusal("[pictures]\nbudgets = [\"1k\"]\nsize = [0, 9]\n"), HasSubstr("line 6"));
  for (const char* budgets : {"\"all\"", "\"1e30k\"", "\"0.0001k\"", "\"1k\", \"1000\""})
    EXPECT_THAT(refusal(std::string("[pictures]\nbudgets = [") + budgets + "]\n"),
                HasSubstr("line 5: pictures: budgets: found"));
  EXPECT_THAT(refusal("at = \"1e30M\"\n"), HasSubstr("at"));
}

TEST(StudyFile, PlacesAreLevelsSharesOrPoints) {
  const auto at = [](const std::string& value) {
    return place_words(parse_study("at = " + value + "\n" + kInput, "s.toml").at);
  };
  EXPECT_EQ(at("2"), "2 levels above the leaves");
  EXPECT_EQ(at("\"12.5%\""), "12.5 % of the points drawn");
  EXPECT_EQ(at("\"200k\""), "200,000 points drawn");
  EXPECT_EQ(at("\"1.5M\""), "1,500,000 points drawn");
  for (const char* wrong : {"0", "1.5", "\"101%\"", "\"-1k\"", "\"1G\"", "\"nan%\"", "true"})
    EXPECT_THROW(at(wrong), formats::Error) << wrong;
}

}  // namespace
}  // namespace cairn::pipeline
