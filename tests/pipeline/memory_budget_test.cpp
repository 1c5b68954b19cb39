#include "pipeline/memory_budget.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;

TEST(MemoryBudget, ReadsSizesInBothFamiliesOfUnits) {
  EXPECT_EQ(parse_size("4GiB"), 4 * kGiB);
  EXPECT_EQ(parse_size("4 gib"), 4 * kGiB);
  EXPECT_EQ(parse_size("4G"), 4 * kGiB);
  EXPECT_EQ(parse_size("4GB"), 4000000000U);
  EXPECT_EQ(parse_size("1.5GiB"), 3 * kGiB / 2);
  EXPECT_EQ(parse_size("256MiB"), kGiB / 4);
  EXPECT_EQ(parse_size("1000000"), 1000000U);
  EXPECT_EQ(parse_size("512kB"), 512000U);
  EXPECT_EQ(parse_size("0"), 0U);
}

TEST(MemoryBudget, RefusesWhatIsNoSize) {
  for (const char* text : {"", "GiB", "-1GiB", "4XB", "4GiBs", "1e40GiB", "nan", "inf", "0x10",
                           "4 G i B", "99999999TiB"})
    EXPECT_FALSE(parse_size(text)) << text;
}

TEST(MemoryBudget, TakesSharesOfTheMachine) {
  EXPECT_EQ(parse_memory("50%", 8 * kGiB), 4 * kGiB);

  EXPECT_EQ(parse_memory("100%", 8 * kGiB), 8 * kGiB);
  EXPECT_EQ(parse_memory("0%", 8 * kGiB), std::nullopt);
  EXPECT_EQ(parse_memory("101%", 8 * kGiB), std::nullopt);
  EXPECT_EQ(parse_memory("%", 8 * kGiB), std::nullopt);
  EXPECT_EQ(parse_memory("2GiB", 8 * kGiB), 2 * kGiB);
}

TEST(MemoryBudget, IsHalfOfTheMachineUnlessAskedFor) {
  EXPECT_EQ(memory_budget(0, 8 * kGiB), 4 * kGiB);
  EXPECT_EQ(memory_budget(kGiB, 8 * kGiB), kGiB);
  EXPECT_EQ(memory_budget(0, 1), kLeastMemoryBytes);
}

class MachineMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    test::write_text(root_ / "proc/meminfo", "MemFree: 1 kB\nMemTotal:   8388608 kB\n");
  }

  test::TemporaryFolder root_;
};

TEST_F(MachineMemory, IsPhysicalMemoryWithoutControlGroups) {
  EXPECT_EQ(machine_memory_bytes(root_.path()), 8 * kGiB);
}

TEST_F(MachineMemory, HeedsVersionOneLimits) {
  test::write_text(root_ / "proc/self/cgroup", "5:cpu:/x\n4:memory:/a/b\n0::/\n");
  test::write_text(root_ / "sys/fs/cgroup/memory/a/b/memory.limit_in_bytes",
                   "9223372036854771712\n");
  test::write_text(root_ / "sys/fs/cgroup/memory/a/memory.limit_in_bytes", "2147483648\n");
  EXPECT_EQ(machine_memory_bytes(root_.path()), 2 * kGiB);
}

TEST_F(MachineMemory, HeedsVersionTwoLimitsOfAllGroupsAbove) {
  test::write_text(root_ / "proc/self/cgroup", "0::/a/b\n");
  test::write_text(root_ / "sys/fs/cgroup/a/b/memory.max", "max\n");
  test::write_text(root_ / "sys/fs/cgroup/a/memory.max", "1073741824\n");
  EXPECT_EQ(machine_memory_bytes(root_.path()), kGiB);
}

TEST_F(MachineMemory, HeedsTheTopGroupOfAContainer) {
  test::write_text(root_ / "proc/self/cgroup", "0::/docker/0123\n");
  test::write_text(root_ / "sys/fs/cgroup/memory.max", "3221225472\n");
  EXPECT_EQ(machine_memory_bytes(root_.path()), 3 * kGiB);
}

TEST(MemoryBudget, KnowsThePeakOfThisProcess) { EXPECT_GT(peak_memory_bytes(), 1U << 20); }

}  // namespace
}  // namespace cairn::pipeline
