// Damaged and hostile inputs, existing outputs, interruptions: nothing half done is ever left, and nothing
// that was there is lost.
#include <sys/stat.h>

#include <csignal>
#include <tuple>

#include "tests/end_to_end/program_test.h"
#include "tests/support/las_bytes.h"
#include "tests/support/shared_data.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Refusal : public ProgramTest {};

TEST_F(Refusal, HostileScansAreBuiltOrRefusedCleanly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const char* suffix : {".las", ".laz", ".ply", ".pcd", ".pts", ".obj", ".e57"}) {
    const auto scans = files_in(CAIRN_SHARED_DATA "/hostile", suffix);
    ASSERT_FALSE(scans.empty()) << suffix;
    for (const fs::path& scan : scans) {
      SCOPED_TRACE(scan.filename().string());
      const Outcome outcome = build({scan});
      if (outcome.exit_code == 0) {
        EXPECT_EQ(cairn({"verify", "--progress", "none", output(), "--against", scan}).exit_code,
                  0);
        EXPECT_FALSE(fs::exists(output() + ".work"));
        fs::remove_all(output());
      } else {
        expect_refusal(outcome, 3);
        EXPECT_THAT(outcome.err, HasSubstr(scan.filename().string()));
      }
    }
  }
}

TEST_F(Refusal, ScansWithoutPointsSaySo) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const char* name : {"no-points.las", "no-points-1.3.las", "no-points-1.3.laz",
                           "ply_empty_ascii.ply", "ply_empty_bin.ply"}) {
    SCOPED_TRACE(name);
    const Outcome outcome = build({std::string(CAIRN_SHARED_DATA "/hostile/") + name});
    expect_refusal(outcome, 3);
    EXPECT_THAT(outcome.err, HasSubstr("point"));
  }
}

TEST_F(Refusal, AFileThatEndsEarlyIsRefusedOrCounted) {
  const std::string scan = write_wavy_las(folder_ / "cut.las", 1000);
  fs::resize_file(scan, 227 + 20 * 600 + 7);
  const Outcome outcome = build({scan});
  expect_refusal(outcome, 3);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("cut.las"), HasSubstr("found"), HasSubstr("expected")));

  ASSERT_EQ(build({scan, "--allow-truncated"}).exit_code, 0);
  EXPECT_EQ(info().at("points"), 600);
  EXPECT_EQ(info().at("missing"), 400);
  EXPECT_EQ(
      cairn({"verify", "--progress", "none", output(), "--against", scan, "--allow-truncated"})
          .exit_code,
      0);
}

TEST_F(Refusal, ClaimsThatCannotBeAddedUpAreRefused) {
  const auto claim = [&](const char* name) {
    LasBytes las{.minor = 4, .point_format = 6, .records = {std::string(30, '\0')}};
    std::string bytes = las.build();
    put_at<std::uint64_t>(bytes, 247, (std::uint64_t{1} << 63) + 1);
    return folder_.write(name, bytes).string();
  };
  const Outcome outcome = build({claim("a.las"), claim("b.las"), "--allow-truncated"});
  expect_refusal(outcome, 3);
  EXPECT_THAT(outcome.err, HasSubstr("more points than can be counted"));
}

TEST_F(Refusal, AnExistingOutputStandsWithoutForce) {
  const std::string scan = write_tiny_ply(folder_ / "a.ply");
  ASSERT_EQ(build({scan}).exit_code, 0);
  const std::string before = read_text(output() + "/nodes.bin");
  const Outcome again = build({scan, "--node-points", "9"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--force"));
  EXPECT_EQ(read_text(output() + "/nodes.bin"), before);
}

TEST_F(Refusal, ForceReplacesOnlyOnceTheNewIsComplete) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string before = read_text(output() + "/nodes.bin");
  write_text(folder_ / "bad.ply",
             "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nend_header\n");
  EXPECT_EQ(build({folder_ / "bad.ply", "--force"}).exit_code, 3);
  EXPECT_EQ(read_text(output() + "/nodes.bin"), before);
  EXPECT_EQ(build({write_tiny_ply(folder_ / "b.ply", 50), "--force"}).exit_code, 0);
  EXPECT_EQ(info().at("points"), 50);
  EXPECT_FALSE(fs::exists(output() + ".work"));
}

TEST_F(Refusal, ForceDoesNotReplaceOtherFolders) {
  write_text(output() + "/thesis.txt", "years of work");
  EXPECT_EQ(build({write_tiny_ply(folder_ / "a.ply"), "--force"}).exit_code, 2);
  EXPECT_EQ(read_text(output() + "/thesis.txt"), "years of work");
}

TEST_F(Refusal, AStoppedBuildSaysSoAndLeavesNoDataset) {
  const std::string scan = write_wavy_las(folder_ / "large.las", 2000000);
  const std::vector<std::tuple<int, std::string, std::string>> stops{
      {SIGINT, "SIGINT", "\"begin\",\"stage\":\"import\""},
      {SIGTERM, "SIGTERM", "\"begin\",\"stage\":\"split\""},
      {SIGHUP, "SIGHUP", "\"begin\",\"stage\":\"cluster\""}};
  for (const auto& [signal, name, after] : stops) {
    const Outcome outcome = run_program(
        CAIRN_PROGRAM, {"build", "--progress", "json", scan, "-o", output()}, signal, after);
    EXPECT_EQ(outcome.exit_code, 128 + signal) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
    EXPECT_THAT(lines_of(outcome.err).front(), HasSubstr(name));
    EXPECT_FALSE(fs::exists(output()));
  }
}

TEST_F(Refusal, AStoppedReplacementKeepsTheOld) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string before = read_text(output() + "/nodes.bin");
  const std::string scan = write_wavy_las(folder_ / "large.las", 2000000);
  const Outcome outcome =
      run_program(CAIRN_PROGRAM, {"build", "--force", "--progress", "json", scan, "-o", output()},
                  SIGINT, "\"stage\":\"cluster\"");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_EQ(read_text(output() + "/nodes.bin"), before);
}

TEST_F(Refusal, ASecondSignalEndsAtOnceAndTheNextBuildCleansUp) {
  // A build that waits for a pipe notices no wish to stop, so that the second one finds it running.
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Outcome outcome = run_program(
      "/bin/bash",
      {"-c",
       std::string(CAIRN_PROGRAM) + " build -o " + output() + " --config " + pipe + " & exec 3>" +
           pipe +
           "; kill -TERM $!; while grep -q '^ShdPnd:.*[1-9a-f]' /proc/$!/status; do sleep 0.01; "
           "done; kill -HUP $!; wait $!"});
  EXPECT_EQ(outcome.exit_code, 128 + SIGHUP);
}

TEST_F(Refusal, AnErrorAfterASignalIsToldAsTheErrorThatItIs) {
  // The build waits for the pipe, so that the signal is there before the mistake is.
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const Outcome outcome = run_program(
      "/bin/bash",
      {"-c", std::string(CAIRN_PROGRAM) + " build -o " + output() + " --config " + pipe +
                 " & exec 3>" + pipe +
                 "; kill -TERM $!; sleep 0.2; echo 'nonsense = 1' >&3; exec 3>&-; wait $!"});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err, HasSubstr("unknown key 'nonsense'"));
}

TEST_F(Refusal, AScanWhoseReaderNeedsMoreThanTheMemoryIsRefused) {
  CAIRN_NEEDS_SHARED_DATA();
  const Outcome outcome = build({CAIRN_SHARED_DATA "/laz/autzen_trim.laz", "--memory", "64MiB"});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("reading autzen_trim.laz"), HasSubstr("64.0 MiB")));
}

TEST_F(Refusal, ABuildStoppedWhileItDecodesLazCleansUpAndSaysSo) {
  CAIRN_NEEDS_SHARED_DATA();
  const Outcome outcome =
      run_program(CAIRN_PROGRAM,
                  {"build", "--progress", "json",
                   CAIRN_SHARED_DATA "/campaign_autzen/autzen_1_1.laz", "-o", output()},
                  SIGINT, "\"begin\"");
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT) << outcome.err;
  EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_FALSE(fs::exists(output()));
  EXPECT_FALSE(fs::exists(output() + ".work"));
}

TEST_F(Refusal, AFullDiskIsASystemErrorAndLeavesNoDataset) {
  const std::string scan = write_wavy_las(folder_ / "large.las", 500000);
  // A limit of the shell's on the size of files: what is written beyond it fails, as on a full disk.
  const Outcome outcome =
      run_program("/bin/bash", {"-c", "ulimit -f 1000; exec " + std::string(CAIRN_PROGRAM) +
                                          " build --progress none " + scan + " -o " + output()});
  expect_refusal(outcome, 4);
}

TEST_F(Refusal, AFlippedByteIsFoundByVerify) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  std::string bytes = read_text(output() + "/nodes.bin");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 16);
  write_text(output() + "/nodes.bin", bytes);
  const Outcome outcome = cairn({"verify", "--progress", "none", output()});
  EXPECT_EQ(outcome.exit_code, 3);
  ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
}

TEST_F(Refusal, VerifyAgainstOtherPointsIsABrokenPromise) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply", 100)}).exit_code, 0);
  const std::string other = write_tiny_ply(folder_ / "b.ply", 99);
  const Outcome outcome = cairn({"verify", "--progress", "none", output(), "--against", other});
  EXPECT_EQ(outcome.exit_code, 5);
  EXPECT_THAT(outcome.out, HasSubstr("BROKEN"));
  EXPECT_THAT(outcome.err, HasSubstr("cairn: error: "));
}

}  // namespace
}  // namespace cairn::test
