// tests/bench/streaming.py on a small dataset: what it promises of streaming holds, over a line that the relay makes slow.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {
namespace {

TEST(LongStreaming, FirstPictureFullFrontAndBytesAreAsPromised) {
  if (run_program("/bin/sh", {"-c", "command -v nginx"}).exit_code != 0) GTEST_SKIP() << "no nginx";
  TemporaryFolder folder;
  const std::string scan = folder / "scan.las", dataset = folder / "site.cairn";
  ASSERT_EQ(run_program(CAIRN_MAKE_SCAN, {"--points", "600000", "--shape", "terrain", "-o", scan})
                .exit_code,
            0);
  ASSERT_EQ(run_program(CAIRN_PROGRAM, {"build", scan, "-o", dataset, "--progress", "none",
                                        "--node-points", "20000"})
                .exit_code,
            0);
  const Outcome outcome =
      run_program("/usr/bin/python3", {CAIRN_SOURCE "/tests/bench/streaming.py", "--quick",
                                       "--dataset", dataset, "--program", CAIRN_PROGRAM});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(outcome.err, "");
}

}  // namespace
}  // namespace cairn::test
