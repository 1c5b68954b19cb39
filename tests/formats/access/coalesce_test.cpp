#include "formats/access/coalesce.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace cairn::formats {
namespace {

ByteRange range(std::uint64_t offset, std::uint64_t size) {
  return {.offset = offset, .size_bytes = size};
}

TEST(Coalesce, JoinsWhatLiesSideBySide) {
  const std::vector<ByteRange> ranges{range(0, 100), range(100, 50), range(150, 7)};
  for (std::size_t at = 0; at < ranges.size(); ++at) {
    const RangeRun run = run_around(ranges, at, {});
    EXPECT_EQ(run.first, 0u);
    EXPECT_EQ(run.end, 3u);
  }
}

TEST(Coalesce, StopsAtAGapThatIsDearerThanARequest) {
  const CoalesceLimits limits{
      .gap_bytes = 10, .request_bytes = 1'000'000, .wanted_per_gap_byte = 16};
  const std::vector<ByteRange> ranges{range(0, 1000), range(1010, 1000), range(2021, 1000)};
  const RangeRun run = run_around(ranges, 0, limits);
  EXPECT_EQ(run.end, 2u) << "a gap of 10 bytes is joined, one of 11 is not";
}

TEST(Coalesce, GapsStayASmallShareOfWhatIsWanted) {
  const CoalesceLimits limits{
      .gap_bytes = 100, .request_bytes = 1'000'000, .wanted_per_gap_byte = 16};
  // 1,600 bytes wanted bear a gap of 100; 1,599 do not.
  EXPECT_EQ(run_around(std::vector{range(0, 800), range(900, 800)}, 0, limits).end, 2u);
  EXPECT_EQ(run_around(std::vector{range(0, 800), range(900, 799)}, 0, limits).end, 1u);
}

TEST(Coalesce, ALargeRangeStaysAlone) {
  const std::vector<ByteRange> ranges{range(0, 10), range(10, 10'000'000), range(10'000'010, 10)};
  const RangeRun run = run_around(ranges, 1, {});
  EXPECT_EQ(run.first, 1u);
  EXPECT_EQ(run.end, 2u);
}

TEST(Coalesce, KeepsItsLimitsOnAnyRanges) {
  std::mt19937_64 random(7);
  const CoalesceLimits limits;
  for (int round = 0; round < 2000; ++round) {
    std::vector<ByteRange> ranges;
    std::uint64_t end = 0;
    for (std::uint64_t i = 0, n = 1 + random() % 20; i < n; ++i) {
      ranges.push_back(range(end + random() % 4096 * (random() % 2), 1 + random() % 60'000));
      end = ranges.back().end();
    }
    const std::size_t at = random() % ranges.size();
    const RangeRun run = run_around(ranges, at, limits);
    ASSERT_TRUE(run.first <= at && at < run.end && run.end <= ranges.size());
    std::uint64_t wanted = 0;
    for (std::size_t i = run.first; i < run.end; ++i) {
      wanted += ranges[i].size_bytes;
      if (i > run.first) EXPECT_LE(ranges[i].offset - ranges[i - 1].end(), limits.gap_bytes);
    }
    const std::uint64_t all = ranges[run.end - 1].end() - ranges[run.first].offset;
    if (run.end - run.first > 1) EXPECT_LE(all, limits.request_bytes);
    EXPECT_LE(all - wanted, wanted / limits.wanted_per_gap_byte);
  }
}

}  // namespace
}  // namespace cairn::formats
