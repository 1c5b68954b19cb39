#include "pipeline/manual/manual.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "pipeline/manual/completion.h"
#include "pipeline/manual/help_text.h"
#include "pipeline/manual/man_page.h"
#include "pipeline/settings.h"
#include "tests/support/environment.h"

namespace cairn::pipeline {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Manual, WordsOfAChoiceAreThoseOfAListAndOfNoOtherProse) {
  EXPECT_THAT(words_of_choice("none, lzo, lzo999 or zstd"),
              ElementsAre("none", "lzo", "lzo999", "zstd"));
  EXPECT_THAT(words_of_choice("normals or radii"), ElementsAre("normals", "radii"));
  for (const char* prose : {"a number above 0", "an integer from 2 to 64, or auto", "a path",
                            "names of attributes, such as color or gps_time",
                            "EPSG:number (projected or geographic) or WKT", "", " or ", "a or "})
    EXPECT_THAT(words_of_choice(prose), IsEmpty()) << prose;
}

/// A setting takes every word that its `allowed` lists, and no other.
TEST(Manual, SettingsTakeTheWordsThatAreOfferedForThem) {
  int with_words = 0;
  for (const Setting& setting : build_settings()) {
    const std::vector<std::string> words = words_of_choice(setting.allowed);
    if (setting.kind == SettingKind::kSwitch || words.empty()) continue;
    ++with_words;
    BuildSettings settings;
    for (const std::string& word : words)
      EXPECT_TRUE(setting.apply(settings, {word})) << setting.key << " " << word;
    EXPECT_FALSE(setting.apply(settings, {words.front() + "x"})) << setting.key;
  }
  EXPECT_GE(with_words, 7);
}

/// A program whose texts hold what shells and roff give a meaning.
class Declared : public ::testing::Test {
 protected:
  void SetUp() override {
    program_.footer(
        "It's `quoted` $HOME.\nSecond line.\n\nExamples:\n  cairn go 'a b' \\\n.hidden");
    CLI::App& go = *program_.add_subcommand("go", "Go: 100% [now]; it's \"safe\".");
    go.add_option("scans", scans_, "what to take")->option_text("SCANS")->expected(0, 1000);
    go.add_option("-o,--output", text_, "where 'it' goes, \\n is [kept]: yes")
        ->option_text("NAME.cairn")
        ->required();
    go.add_option("--mode", text_, "how")
        ->option_text("a|B|auto")
        ->check(CLI::IsMember({"auto", "off"}));
    go.add_option("--picture", text_, "a picture")->option_text("FILE.png");
    go.add_option("--again", scans_, "again")
        ->option_text("COUNT")
        ->expected(1, 1000)
        ->allow_extra_args(false);
    go.add_flag("--force", force_, "do it")->group("Strength");
  }

  CLI::App program_{"A program.", "cairn"};
  std::vector<std::string> scans_;
  std::string text_;
  bool force_ = false;
};

TEST_F(Declared, IsToldAsData) {
  const ProgramText text = describe_program(program_);
  ASSERT_EQ(text.commands.size(), 1U);
  const CommandText& go = text.commands.front();
  EXPECT_EQ(go.name, "go");
  EXPECT_EQ(go.usage(), "cairn go [OPTIONS] [SCANS...] -o NAME.cairn");
  EXPECT_THAT(go.groups(), ElementsAre("Options", "Strength"));
  ASSERT_EQ(go.flags.size(), 7U);
  EXPECT_EQ(go.flags[1].kind, ValueKind::kFile);
  EXPECT_TRUE(go.flags[1].is_argument() && go.flags[1].repeatable);
  EXPECT_THAT(go.flags[1].suffixes, ::testing::Contains(".laz"));
  EXPECT_EQ(go.flags[2].short_name + go.flags[2].long_name, "-o--output");
  EXPECT_EQ(go.flags[2].kind, ValueKind::kDataset);
  EXPECT_TRUE(go.flags[2].required);
  EXPECT_THAT(go.flags[3].words, ElementsAre("a", "auto", "off"));
  EXPECT_THAT(go.flags[4].suffixes, ElementsAre(".png"));
  EXPECT_TRUE(go.flags[5].repeatable && !go.flags[5].greedy);
  EXPECT_EQ(go.flags[1].value(), "SCANS...");
  EXPECT_EQ(go.flags[6].kind, ValueKind::kNone);
  const auto& details = text.program.details;
  ASSERT_EQ(details.size(), 4U);
  EXPECT_THAT(details[0].lines, ElementsAre("It's `quoted` $HOME.", "Second line."));
  EXPECT_TRUE(details[2].verbatim);
}

TEST_F(Declared, HelpKeepsToItsColumns) {
  const CommandText go = describe_program(program_).commands.front();
  for (unsigned columns = 40; columns < 130; columns += 5) {
    std::istringstream lines(help_text(go, {}, columns, Paint()));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), columns) << line;
  }
  program_.footer(
      "Examples:\n  cairn go a.las b.las --mode auto --picture \"a long name.png\" -o c.cairn");
  EXPECT_THAT(help_text(describe_program(program_).program, {}, 50, Paint()),
              HasSubstr("\n  cairn go a.las b.las --mode auto \\\n"
                        "      --picture \"a long name.png\" -o c.cairn\n"));
  const std::string help = help_text(go, {}, 80, Paint());
  EXPECT_THAT(help, HasSubstr("\n  -o, --output NAME.cairn   where 'it' goes"));
  EXPECT_THAT(help, HasSubstr("\nStrength:\n      --force               do it\n"));
}

TEST_F(Declared, TextsAreEscapedForEachReader) {
  const ProgramText text = describe_program(program_);
  const std::string page = man_page(text, "1.2.3");
  EXPECT_THAT(page, HasSubstr("It\\(aqs \\(gaquoted\\(ga $HOME."));
  EXPECT_THAT(page, HasSubstr("\n\\&.hidden\n"));
  EXPECT_THAT(page, HasSubstr("\\en is [kept]"));
  EXPECT_THAT(zsh_completion(text),
              HasSubstr("[where '\\''it'\\'' goes, \\\\n is \\[kept\\]\\: yes]"));
  EXPECT_THAT(fish_completion(text), HasSubstr("-d 'where \\'it\\' goes, \\\\n is [kept]: yes'"));
}

TEST(HelpColumns, AreThoseThatTheEnvironmentAsksFor) {
  for (const auto& [asked, columns] : std::map<std::string, unsigned>{
           {"60", 60}, {"100", 100}, {"500", 100}, {"wide", 80}, {"-3", 80}, {"", 80}, {"0", 80}}) {
    const test::Environment environment(std::map<std::string, std::string>{{"COLUMNS", asked}});
    // The test's stdout is no terminal under ctest; where it is one, it has its own width.
    if (columns != 80 || ::isatty(1) == 0) EXPECT_EQ(help_columns(), columns) << asked;
  }
}

}  // namespace
}  // namespace cairn::pipeline
