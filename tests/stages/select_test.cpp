#include "stages/split/select.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "tests/support/temporary_folder.h"

namespace cairn::stages {
namespace {

using formats::ExternalArray;
using formats::GridPoint;

TEST(SelectRanks, EqualsSortingForEverySpanAndManyTies) {
  const test::TemporaryFolder folder;
  const Context context;
  std::mt19937_64 random(11);
  for (const std::uint64_t span : {0ULL, 1ULL, 3ULL, 1000ULL, 65535ULL, 65536ULL, (1ULL << 24),
                                   (1ULL << 30), (1ULL << 32) - 1}) {
    const std::size_t count = 5000;
    ExternalArray array(folder.path() / std::to_string(span), count * 12);
    std::vector<std::uint32_t> keys(count);
    const std::int32_t low = span > INT32_MAX ? INT32_MIN : -1000;
    for (std::size_t i = 0; i < count; ++i) {
      // Half of the points share few values.
      keys[i] = static_cast<std::uint32_t>(random() % 2 == 0 ? random() % (span + 1)
                                                             : random() % 3 * (span / 3));
      const GridPoint p{7, static_cast<std::int32_t>(low + static_cast<std::int64_t>(keys[i])), -7};
      std::memcpy(array.bytes().data() + 12 * i, p.data(), 12);
    }
    std::vector<Slab> slabs;
    for (std::size_t first = 0; first < count; first += 700)
      slabs.push_back({&array, first * 12, std::min<std::size_t>(700, count - first), 12});
    std::vector<std::uint64_t> ranks;
    for (std::uint64_t i = 1; i < 9; ++i) ranks.push_back(i * count / 9);
    const std::vector<std::uint32_t> in_order = keys;
    std::sort(keys.begin(), keys.end());
    for (const std::uint64_t most_collected : {0, 100, 1'000'000}) {
      const bool parallel = most_collected == 100;
      const Selection selection =
          select_ranks(slabs, 1, low, static_cast<std::uint32_t>(span), ranks,
                       {context, parallel, parallel}, most_collected);
      const auto& boundaries = selection.boundaries;
      ASSERT_EQ(boundaries.size(), ranks.size());
      for (std::size_t i = 0; i < ranks.size(); ++i) {
        EXPECT_EQ(boundaries[i].key, keys[ranks[i]]) << span;
        EXPECT_EQ(boundaries[i].less,
                  static_cast<std::uint64_t>(
                      std::lower_bound(keys.begin(), keys.end(), keys[ranks[i]]) - keys.begin()));
        EXPECT_EQ(boundaries[i].equal,
                  static_cast<std::uint64_t>(std::ranges::count(keys, keys[ranks[i]])));
        for (std::size_t slab = 0; slab < slabs.size(); ++slab) {
          const auto own = std::span(in_order).subspan(700 * slab, slabs[slab].count);
          const Boundary& found = selection.slabs[slab][i];
          EXPECT_EQ(found.key, keys[ranks[i]]);
          EXPECT_EQ(found.less, static_cast<std::uint64_t>(std::ranges::count_if(
                                    own, [&](std::uint32_t key) { return key < found.key; })));
          EXPECT_EQ(found.equal, static_cast<std::uint64_t>(std::ranges::count(own, found.key)));
        }
      }
    }
  }
}

}  // namespace
}  // namespace cairn::stages
