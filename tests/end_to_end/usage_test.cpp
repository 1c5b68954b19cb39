// Command lines, right and wrong.
#include <csignal>

#include "pipeline/settings.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class Usage : public ProgramTest {};

TEST_F(Usage, HelpAndVersionAreAnswers) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--help"},
                                             {"build", "--help"},
                                             {"info", "-h"},
                                             {"verify", "--help"},
                                             {"report", "--help"},
                                             {"export", "--help"},
                                             {"simulate", "--help"},
                                             {"study", "--help"}}) {
    const Outcome outcome = cairn(arguments);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_THAT(outcome.out, HasSubstr("Examples:"));
  }
  EXPECT_THAT(cairn({"--version"}).out,
              ::testing::MatchesRegex("cairn [0-9]+\\.[0-9]+\\.[0-9]+\n"
                                      "codecs none, lzo, lzo999 or zstd; vector instructions "
                                      "(portable|avx2|avx512)\n"
                                      "GPL-3.0-or-later\n"));
  EXPECT_EQ(cairn({"--generate", "tcsh"}).exit_code, 2);
}

TEST_F(Usage, WrongCommandLinesAreOneLineAndExitCodeTwo) {
  const std::string scan = write_tiny_ply(folder_ / "a.ply");
  const std::vector<std::vector<std::string>> wrong{
      {},
      {"bild"},
      {"build"},
      {"build", scan},
      {"build", "-o", output()},
      {"build", scan, "-o", output(), "--fanout", "1"},
      {"build", scan, "-o", output(), "--fanout", "many"},
      {"build", scan, "-o", output(), "--fanout"},
      {"build", scan, "-o", output(), "--node-points", "0"},
      {"build", scan, "-o", output(), "--theta=-1"},
      {"build", scan, "-o", output(), "--codec", "gzip"},
      {"build", scan, "-o", output(), "--memory", "lots"},
      {"build", scan, "-o", output(), "--nonsense"},
      {"build", scan, "-o", output(), "--drop", "warmth", "--progress", "none"},
      {"build", scan, "-o", folder_ / "none/site.cairn"},
      {"build", scan, "-o", output(), "--scratch", folder_ / "none"},
      {"build", scan, "-o", output(), "--fanout", "8", "--node-points", "7"},
      {"info"},
      {"verify"},
      {"simulate"},
      {"simulate", folder_ / "none.toml"},
      {"study"},
      {"study", folder_ / "none.toml"},
      {"export", folder_ / "none.cairn"}};
  for (const auto& arguments : wrong) {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    expect_refusal(cairn(arguments), 2);
  }
}

TEST_F(Usage, AnUnknownFlagPointsToTheHelp) {
  EXPECT_THAT(cairn({"build", "--nonsense"}).err, HasSubstr("see cairn build --help"));
}

TEST_F(Usage, AnUnknownCommandIsNamedWithTheOneThatWasMeant) {
  EXPECT_THAT(cairn({"bild"}).err, HasSubstr("unknown command 'bild'; did you mean 'build'?"));
  EXPECT_THAT(cairn({"transmogrify"}).err,
              HasSubstr("commands are build, info, verify, report, measure, study, export, render, "
                        "view, simulate"));
}

TEST_F(Usage, HelpTellsWhatIsAllowed) {
  const std::string help = cairn({"build", "--help"}).out;
  for (const char* key : {"memory", "theta", "position_bits", "node_points", "codec"}) {
    const pipeline::Setting& setting = *pipeline::find_setting(key);
    std::string squeezed;  // the help is wrapped into columns
    for (const char c : help)
      if (c != ' ' && c != '\n') squeezed += c;
    std::string expected;
    for (const char c : setting.allowed)
      if (c != ' ') expected += c;
    EXPECT_THAT(squeezed, HasSubstr("(" + expected + ")"));
  }
}

TEST_F(Usage, AConfigurationNamesFileLineKeyAndWhatIsAllowed) {
  write_text(folder_ / "site.toml", "scans = [\"a.ply\"]\noutput = \"site.cairn\"\nfanout = 1\n");
  const Outcome outcome = cairn({"build", folder_ / "site.toml"});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err,
              HasSubstr("site.toml, line 3: fanout: found '1', expected an integer from 2 to 64"));
}

TEST_F(Usage, MissingScansAndDatasetsAreSystemErrors) {
  expect_refusal(build({folder_ / "none.las"}), 4);
  expect_refusal(cairn({"info", folder_ / "none.cairn"}), 4);
}

TEST_F(Usage, AScanThatIsGivenTwiceIsRefusedUnderBothNames) {
  const std::string scan = write_tiny_ply(folder_ / "a.ply");
  fs::create_symlink(scan, folder_ / "link.ply");
  fs::create_hard_link(scan, folder_ / "hard.ply");
  for (const std::string& other :
       std::vector<std::string>{scan, (folder_ / "./a.ply").string(),
                                (folder_ / "link.ply").string(), (folder_ / "hard.ply").string()}) {
    const Outcome outcome = build({scan, write_tiny_ply(folder_ / "b.ply"), other});
    expect_refusal(outcome, 2);
    EXPECT_THAT(outcome.err, HasSubstr("given twice, as " + scan + " and as " + other));
  }
}

TEST_F(Usage, AConfigurationBuildsRelativeToItself) {
  write_tiny_ply(folder_ / "job/scans/a.ply");
  write_text(
      folder_ / "job/site.toml",
      "scans = [\"scans/a.ply\"]\noutput = \"../site.cairn\"\nprogress = \"none\"\nfanout = 3\n");
  const Outcome outcome = cairn({"build", folder_ / "job/site.toml", "--node-points", "10"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(info().at("tree").at("fanout"), 3);
  EXPECT_EQ(info().at("tree").at("target_points"), 10);
}

TEST_F(Usage, ResultsThatCannotBeWrittenAreASystemError) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string shell = std::string(CAIRN_PROGRAM) + " info " + output() + " > /dev/full";
  const Outcome outcome = run_program("/bin/sh", {"-c", shell});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err,
              HasSubstr("cairn: error: cannot write the results to stdout: No space left"));
}

TEST_F(Usage, ClosedStandardStreamsDoNotEndUpInFiles) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000)}).exit_code, 0);
  for (const std::string closed : {"", " >&- 2>&-", " <&- >&- 2>&-"}) {
    const std::string shell = std::string(CAIRN_PROGRAM) + " export --progress json --force " +
                              output() + " -o " + (folder_ / "back.las").string() + closed;
    ASSERT_EQ(run_program("/bin/sh", {"-c", shell}).exit_code, 0);
    if (closed.empty()) fs::copy_file(folder_ / "back.las", folder_ / "expected.las");
    EXPECT_TRUE(read_text(folder_ / "back.las") == read_text(folder_ / "expected.las")) << closed;
  }
}

TEST_F(Usage, AnEmptyConfigurationSaysNothing) {
  write_text(folder_ / "site.toml", "");
  const std::string scan = write_tiny_ply(folder_ / "a.ply");
  EXPECT_EQ(build({scan, "--config", folder_ / "site.toml"}).exit_code, 0);
  const Outcome outcome = cairn({"build", "--config", folder_.path()});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err, HasSubstr("cannot read the TOML file"));
}

TEST_F(Usage, TheSuffixOfAnExportMayBeInAnyCase) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000)}).exit_code, 0);
  for (const char* name : {"back.las", "back.Las", "back.Ply"})
    EXPECT_EQ(cairn({"export", "--progress", "none", output(), "-o", folder_ / name}).exit_code, 0)
        << name;
  EXPECT_TRUE(read_text(folder_ / "back.las") == read_text(folder_ / "back.Las"));
}

TEST_F(Usage, AReaderOfResultsMayLeave) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string shell = "(sleep 0.2; " + std::string(CAIRN_PROGRAM) + " info " + output() +
                            "; echo $? > " + (folder_ / "code").string() + ") | true";
  EXPECT_EQ(run_program("/bin/bash", {"-c", shell}).err, "");
  EXPECT_EQ(read_text(folder_ / "code"), "0\n");
}

TEST_F(Usage, SeveralCampaignsRunOneAfterAnotherAndTheWorstCodeIsReturned) {
  write_tiny_ply(folder_ / "a.ply", 20);
  write_text(folder_ / "one.toml", "scans = [\"a.ply\"]\noutput = \"one.cairn\"\n");
  write_text(folder_ / "bad.toml", "scans = [\"bad.ply\"]\noutput = \"bad.cairn\"\n");
  write_text(folder_ / "bad.ply", "ply\nnonsense\n");
  write_text(folder_ / "three.toml", "scans = [\"a.ply\"]\noutput = \"three.cairn\"\n");
  const Outcome outcome = cairn({"build", "--progress", "none", folder_ / "one.toml",
                                 folder_ / "bad.toml", folder_ / "three.toml"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "one.cairn/index.bin"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "three.cairn/index.bin"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bad.cairn"));
  ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("bad.toml: "));
  EXPECT_THAT(outcome.out, HasSubstr("failed: 3"));
  EXPECT_EQ(cairn({"build", "--progress", "none", "--force", folder_ / "one.toml",
                   folder_ / "three.toml"})
                .exit_code,
            0);
}

TEST_F(Usage, VerifyTakesOneConfigurationOrScansAndWhatTellsOfThem) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  for (const char* name : {"a.toml", "b.toml"}) write_text(folder_ / name, "scans = [\"a.ply\"]\n");
  const auto verify = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"verify", "--progress", "none", output()});
    return cairn(arguments);
  };
  EXPECT_EQ(verify({"--against", folder_ / "a.toml"}).exit_code, 0);
  for (const std::string other : {"b.toml", "a.ply"}) {
    const Outcome outcome = verify({"--against", folder_ / "a.toml", folder_ / other});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("--against takes one configuration file, or scans"));
  }
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--poses", folder_ / "p.tsv"}, {"--allow-truncated"}}) {
    const Outcome outcome = verify(flags);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr(flags.front() + " tells of scans: --against them"));
  }
}

TEST_F(Usage, SeveralCampaignsOfOneOutputAreRefusedBeforeTheFirstIsBuilt) {
  write_tiny_ply(folder_ / "a.ply", 20);
  fs::create_directory_symlink(folder_.path(), folder_ / "here");
  write_text(folder_ / "one.toml", "scans = [\"a.ply\"]\noutput = \"site.cairn\"\n");
  for (const std::string other : {"site.cairn", "./site.cairn/", "here/site.cairn"}) {
    write_text(folder_ / "two.toml", "scans = [\"a.ply\"]\noutput = \"" + other + "\"\n");
    const Outcome outcome = cairn({"build", "--force", folder_ / "one.toml", folder_ / "two.toml"});
    expect_refusal(outcome, 2);
    EXPECT_THAT(outcome.err,
                AllOf(HasSubstr("one.toml and "), HasSubstr("two.toml have the same")));
  }
}

TEST_F(Usage, AStoppedBatchTellsWhatWasBuilt) {
  write_tiny_ply(folder_ / "a.ply", 20);
  write_wavy_las(folder_ / "large.las", 2000000);
  write_text(folder_ / "one.toml", "scans = [\"a.ply\"]\noutput = \"one.cairn\"\n");
  write_text(folder_ / "two.toml", "scans = [\"large.las\"]\noutput = \"two.cairn\"\n");
  const Outcome outcome = run_program(
      CAIRN_PROGRAM, {"build", "--progress", "json", folder_ / "one.toml", folder_ / "two.toml"},
      SIGINT, "\"stage\":\"import\",\"points\":0,\"total_points\":2000000");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("what was under way changed nothing"));
  EXPECT_THAT(outcome.out, ContainsRegex("\nbuilt +20 .*one.toml.*\nstopped .*two.toml\n"));
  EXPECT_TRUE(fs::exists(folder_ / "one.cairn/index.bin"));
  EXPECT_FALSE(fs::exists(folder_ / "two.cairn"));
}

TEST_F(Usage, SeveralCampaignsTellTheirOwnOutputs) {
  write_text(folder_ / "a.toml", "scans = [\"a.ply\"]\n");
  expect_refusal(cairn({"build", folder_ / "a.toml", folder_ / "a.toml", "-o", output()}), 2);
}

}  // namespace
}  // namespace cairn::test
