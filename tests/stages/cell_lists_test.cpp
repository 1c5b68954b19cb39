#include "stages/cluster/cell_lists.h"

#include <gtest/gtest.h>

#include <numeric>
#include <queue>
#include <random>

namespace cairn::stages {
namespace {

// The literal procedure: a priority queue of lists, the longest popped and shortened by one until the
// quota is reached or nothing is longer than one. Returns the sorted lengths; which of equally long
// lists is shortened is left open by the paper.
std::vector<std::uint32_t> play_out(std::vector<std::uint32_t> lengths, std::uint64_t quota) {
  std::priority_queue<std::uint32_t> queue(lengths.begin(), lengths.end());
  std::uint64_t total = std::accumulate(lengths.begin(), lengths.end(), std::uint64_t{0});
  while (total > quota && queue.top() > 1) {
    const std::uint32_t longest = queue.top();
    queue.pop();
    queue.push(longest - 1);
    --total;
  }
  std::vector<std::uint32_t> result;
  for (; !queue.empty(); queue.pop()) result.push_back(queue.top());
  return result;
}

TEST(LeveledLength, EqualsTheLiteralQueue) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<std::uint32_t> lengths(1 + random() % 40);
    for (auto& length : lengths) length = 1 + random() % (trial % 2 == 0 ? kMaxListLength : 4);
    const std::uint64_t total = std::accumulate(lengths.begin(), lengths.end(), std::uint64_t{0});
    const std::uint64_t quota = 1 + random() % total;
    ASSERT_EQ(leveled_length(lengths, quota), play_out(lengths, quota).front());
  }
}

TEST(CutLists, SharesLeadingBitsAndStaysShort) {
  std::mt19937_64 random(3);
  std::vector<std::uint64_t> keys(5000);
  for (auto& key : keys) key = random() % (std::uint64_t{1} << (random() % 2 == 0 ? 48 : 40));
  std::sort(keys.begin(), keys.end());
  for (int bits = 0; bits <= 16; ++bits) {
    const std::uint32_t longest = 1 + static_cast<std::uint32_t>(random() % kMaxListLength);
    const auto starts = cut_lists(keys, bits, longest);
    ASSERT_EQ(starts.front(), 0U);
    ASSERT_EQ(starts.back(), keys.size());
    for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
      ASSERT_LT(starts[i], starts[i + 1]);
      ASSERT_LE(starts[i + 1] - starts[i], longest);
      ASSERT_EQ(keys[starts[i]] >> (3 * (16 - bits)), keys[starts[i + 1] - 1] >> (3 * (16 - bits)));
    }
  }
}

TEST(AutoCellBits, AimsAtSixteenPointsACell) {
  // A plane of 2^7 x 2^7 points on a lattice of 2^16: 4 x 4 of them share a cell at 5 bits.
  std::vector<std::uint64_t> keys;
  for (std::uint64_t cell = 0; cell < (1 << 14); ++cell) {
    std::uint64_t key =
        0;  // interleave two coordinates with a zero third one: any curve with prefixes will do
    for (int bit = 13; bit >= 0; --bit)
      key = bit % 2 == 1 ? (key << 2 | ((cell >> bit) & 1)) : (key << 1 | ((cell >> bit) & 1));
    keys.push_back(key << 27);
  }
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(auto_cell_bits(keys), 5);
  EXPECT_EQ(auto_cell_bits(std::vector<std::uint64_t>(10, 5)), 0);
}

}  // namespace
}  // namespace cairn::stages
