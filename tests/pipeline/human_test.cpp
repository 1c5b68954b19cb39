#include "pipeline/human.h"

#include <gtest/gtest.h>

namespace cairn::pipeline {
namespace {

TEST(Human, GroupsDigits) {
  EXPECT_EQ(with_commas(0), "0");
  EXPECT_EQ(with_commas(999), "999");
  EXPECT_EQ(with_commas(1000), "1,000");
  EXPECT_EQ(with_commas(186850683), "186,850,683");
}

TEST(Human, ScalesBytes) {
  EXPECT_EQ(human_bytes(1023), "1023 bytes");
  EXPECT_EQ(human_bytes(1536), "1.5 KiB");
  EXPECT_EQ(human_bytes(std::uint64_t{300} << 20), "300 MiB");
}

TEST(Human, ScalesRatesAndTimes) {
  EXPECT_EQ(human_rate(11800000), "11.8 M points/s");
  EXPECT_EQ(human_rate(15300), "15 k points/s");
  EXPECT_EQ(human_duration(0.42), "0.42 s");
  EXPECT_EQ(human_duration(12.34), "12.3 s");
  EXPECT_EQ(human_duration(245), "4:05");
  EXPECT_EQ(clock_duration(3723), "1:02:03");
  EXPECT_EQ(clock_duration(7.4), "0:07");
}

TEST(Human, CountsThings) {
  EXPECT_EQ(count_of(1, "scan"), "1 scan");
  EXPECT_EQ(count_of(2000, "scan"), "2,000 scans");
}

TEST(Human, ControlCharactersDoNotReachTheTerminal) {
  EXPECT_EQ(printable("a\x1b[31mb\n\x7f"), "a?[31mb??");
  EXPECT_EQ(printable("a\xc2\x9b"
                      "b"),
            "a?b");
  EXPECT_EQ(printable("\xc2"), "\xc2");
  EXPECT_EQ(printable("caf\xc3\xa9 \xc2\xb0"), "caf\xc3\xa9 \xc2\xb0");
}

}  // namespace
}  // namespace cairn::pipeline
