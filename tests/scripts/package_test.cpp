// scripts/package.sh --check: the Debian packages, installed in a bare Debian.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/run_program.h"

namespace cairn::test {
namespace {

TEST(LongPackage, InstallsAndWorksInABareDebian) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, for chroot";
  const Outcome outcome = run_program(CAIRN_SOURCE "/scripts/package.sh", {"--check"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, ::testing::EndsWith("Checked.\n"));
}

TEST(Package, TellsItsUsage) {
  const Outcome outcome = run_program(CAIRN_SOURCE "/scripts/package.sh", {"--nonsense"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, ::testing::HasSubstr("scripts/package.sh --check"));
}

}  // namespace
}  // namespace cairn::test
