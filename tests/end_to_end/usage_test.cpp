// Command lines, right and wrong.
#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class Usage : public ProgramTest {};

TEST_F(Usage, HelpAndVersionAreAnswers) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--help"},
                                             {"build", "--help"},
                                             {"info", "-h"},
                                             {"verify", "--help"},
                                             {"export", "--help"},
                                             {"simulate", "--help"}}) {
    const Outcome outcome = cairn(arguments);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_THAT(outcome.out, HasSubstr("Examples:"));
  }
  EXPECT_THAT(cairn({"--version"}).out,
              ::testing::MatchesRegex("cairn [0-9]+\\.[0-9]+\\.[0-9]+\n"));
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
      {"build", scan, "-o", output(), "--drop", "warmth"},
      {"build", scan, "-o", folder_ / "none/site.cairn"},
      {"build", scan, "-o", output(), "--scratch", folder_ / "none"},
      {"build", scan, "-o", output(), "--fanout", "8", "--node-points", "7"},
      {"info"},
      {"verify"},
      {"simulate"},
      {"simulate", folder_ / "none.toml"},
      {"export", folder_ / "none.cairn"}};
  for (const auto& arguments : wrong) {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    expect_refusal(cairn(arguments), 2);
  }
}

TEST_F(Usage, AnUnknownFlagPointsToTheHelp) {
  EXPECT_THAT(cairn({"build", "--nonsense"}).err, HasSubstr("see cairn build --help"));
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

TEST_F(Usage, AReaderOfResultsMayLeave) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string shell = "(sleep 0.2; " + std::string(CAIRN_PROGRAM) + " info " + output() +
                            "; echo $? > " + (folder_ / "code").string() + ") | true";
  EXPECT_EQ(run_program("/bin/bash", {"-c", shell}).err, "");
  EXPECT_EQ(read_text(folder_ / "code"), "0\n");
}

}  // namespace
}  // namespace cairn::test
