#include "formats/access/range_table.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace cairn::formats {
namespace {

constexpr std::uint64_t kRoom = 1 << 20;

RangeKey key(std::uint64_t offset, std::uint64_t size = 100) {
  return {.file = 0, .front = false, .offset = offset, .size_bytes = size};
}

SharedBytes bytes(std::uint64_t size) {
  return std::make_shared<const std::vector<std::byte>>(size);
}

class RangeTableTest : public testing::Test {
 protected:
  void wish(RangeTable::List& list, std::vector<RangeKey> keys, bool on_disk = false) {
    const std::size_t n = keys.size();
    table_.replace(list, std::move(keys), std::vector<std::optional<std::uint64_t>>(n, 1),
                   std::vector<bool>(n, on_disk));
  }
  /// The first range of what would be fetched next; nothing is joined here.
  std::optional<std::uint64_t> next() {
    const auto keys = table_.take_next(kRoom, {.gap_bytes = 0});
    if (keys.empty()) return std::nullopt;
    EXPECT_EQ(keys.size(), 1u);
    return keys.front().offset;
  }

  RangeTable table_{1000};
};

TEST_F(RangeTableTest, TheMostUrgentWishComesFirstAndNewWishesReplaceOld) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(5000), key(1000), key(3000)});
  EXPECT_EQ(next(), 5000u);
  wish(list, {key(7000), key(3000), key(5000)});  // 5000 is under way
  EXPECT_EQ(next(), 7000u);
  EXPECT_EQ(next(), 3000u);
  EXPECT_EQ(next(), std::nullopt) << "1000 is no longer wished for";
}

TEST_F(RangeTableTest, WhatSomebodyWaitsForComesBeforeWishes) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(1000), key(3000)});
  ++table_.at(key(9000)).waiting;
  table_.want_now(key(9000));
  ++table_.at(key(3000)).waiting;
  table_.want_now(key(3000));
  EXPECT_EQ(next(), 9000u);
  EXPECT_EQ(next(), 3000u);
  EXPECT_EQ(next(), 1000u);
}

TEST_F(RangeTableTest, ListsAreServedInTurns) {
  RangeTable::List& one = table_.add_list();
  RangeTable::List& other = table_.add_list();
  wish(one, {key(1000), key(3000)});
  wish(other, {key(10'000), key(30'000)});
  std::set<std::uint64_t> first{*next(), *next()};
  EXPECT_EQ(first, (std::set<std::uint64_t>{1000, 10'000}));
}

TEST_F(RangeTableTest, NeighboursGoAsOneRequestWhateverTheirRank) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(1100), key(9000), key(1000), key(1200), key(1300)});
  table_.put(key(1300), bytes(100));  // here already
  const auto keys = table_.take_next(kRoom, {.gap_bytes = 0});
  EXPECT_EQ(keys, (std::vector{key(1000), key(1100), key(1200)}));
}

TEST_F(RangeTableTest, AFileIsNotJoinedWithAnother) {
  RangeTable::List& list = table_.add_list();
  RangeKey other = key(1100);
  other.file = 1;
  wish(list, {key(1000), other});
  EXPECT_EQ(table_.take_next(kRoom, {}).size(), 1u);
}

TEST_F(RangeTableTest, NothingIsFetchedTwiceWhileThereIsRoom) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(0), key(5000)});
  EXPECT_EQ(next(), 0u);
  table_.put(key(0), bytes(100));
  wish(list, {});
  wish(list, {key(0), key(5000)});
  EXPECT_EQ(next(), 5000u);
  wish(list, {key(9000)});
  wish(list, {key(5000)});  // still under way
  EXPECT_EQ(next(), std::nullopt);
}

TEST_F(RangeTableTest, WhatTheDiskHasIsNotFetched) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(0)}, /*on_disk=*/true);
  EXPECT_EQ(next(), std::nullopt);
  EXPECT_EQ(table_.find(key(0))->state, RangeState::kOnDisk);
}

TEST_F(RangeTableTest, WishesStopWhereMemoryIsFullAndGoOnOnceItIsUsed) {
  RangeTable::List& list = table_.add_list();
  std::vector<RangeKey> keys;
  for (std::uint64_t i = 0; i < 30; ++i) keys.push_back(key(i * 1000));
  wish(list, keys);
  int taken = 0;
  while (const auto offset = next()) {
    table_.put(key(*offset), bytes(100));
    ++taken;
  }
  EXPECT_EQ(taken, 10) << "1,000 bytes are held";
  ++table_.at(key(99'000)).waiting;
  table_.want_now(key(99'000));
  EXPECT_EQ(next(), 99'000u) << "what is waited for comes in any case";
  keys.erase(keys.begin(), keys.begin() + 10);
  wish(list, keys);
  EXPECT_EQ(next(), 10'000u);
  EXPECT_LE(table_.held_bytes(), 1000u);
}

/// Of a node that is larger than the memory nothing could be used before its last section is there.
TEST_F(RangeTableTest, WhatIsOfUseOnlyTogetherComesWholeWhateverItsSize) {
  RangeTable::List& list = table_.add_list(/*together_bytes=*/3000);
  std::vector<RangeKey> keys;
  for (std::uint64_t i = 0; i < 60; ++i) keys.push_back(key(i * 1000));
  wish(list, keys);
  int taken = 0;
  for (; const auto offset = next(); ++taken) table_.put(key(*offset), bytes(100));
  EXPECT_EQ(taken, 30);
}

TEST_F(RangeTableTest, PartsOfWhatIsLessUrgentDoNotHoldUpTheRest) {
  RangeTable::List& list = table_.add_list(/*together_bytes=*/500);
  std::vector<RangeKey> keys;
  for (std::uint64_t i = 0; i < 20; ++i) keys.push_back(key(i * 1000));
  wish(list, keys);
  for (int i = 0; i < 10; ++i) table_.put(key(*next()), bytes(100));
  EXPECT_EQ(next(), std::nullopt);
  keys.insert(keys.begin(), {key(30'000), key(31'000)});
  wish(list, keys);
  EXPECT_EQ(next(), 30'000u);
  EXPECT_EQ(next(), 31'000u);
}

TEST_F(RangeTableTest, WhatNobodyWaitsForAnyMoreIsNeitherFetchedNorKeptAsFailed) {
  for (const std::uint64_t offset : {0, 5000}) {
    ++table_.at(key(offset)).waiting;
    table_.want_now(key(offset));
  }
  EXPECT_EQ(next(), 0u);
  table_.fail(key(0), {ErrorKind::kSystem, {.what = "gone"}});
  table_.leave(key(0));
  table_.leave(key(5000));
  EXPECT_EQ(table_.find(key(0)), nullptr);
  EXPECT_EQ(next(), std::nullopt);
}

TEST_F(RangeTableTest, TheLeastRecentlyUsedGoesFirst) {
  for (std::uint64_t i = 0; i < 10; ++i) table_.put(key(i * 1000), bytes(100));
  table_.touch(*table_.find(key(0)));
  table_.put(key(20'000), bytes(100));
  EXPECT_NE(table_.find(key(0)), nullptr);
  EXPECT_EQ(table_.find(key(1000)), nullptr);
  EXPECT_EQ(table_.held_bytes(), 1000u);
}

TEST_F(RangeTableTest, AFailureIsKeptForThoseWhoWishAndForgottenWithThem) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(0), key(5000)});
  EXPECT_EQ(next(), 0u);
  table_.fail(key(0), {ErrorKind::kSystem, {.what = "gone"}});
  EXPECT_EQ(table_.find(key(0))->state, RangeState::kFailed);
  table_.fail_wanted({ErrorKind::kSystem, {.what = "gone"}});
  EXPECT_EQ(table_.find(key(5000))->state, RangeState::kFailed);
  EXPECT_EQ(next(), std::nullopt);
  wish(list, {});
  EXPECT_EQ(table_.find(key(0)), nullptr);
  wish(list, {key(0)});
  EXPECT_EQ(next(), 0u) << "who wishes again tries again";
}

TEST_F(RangeTableTest, ARemovedListTakesItsWishesWithIt) {
  RangeTable::List& list = table_.add_list();
  wish(list, {key(0)});
  table_.remove_list(list);
  EXPECT_EQ(next(), std::nullopt);
  EXPECT_EQ(table_.find(key(0)), nullptr);
}

TEST_F(RangeTableTest, AnyOrderOfCallsKeepsItsBounds) {
  std::mt19937_64 random(11);
  RangeTable::List* lists[] = {&table_.add_list(), &table_.add_list()};
  std::set<RangeKey> under_way;
  for (int i = 0; i < 20'000; ++i) {
    switch (random() % 5) {
      case 0: {
        std::set<RangeKey> keys;
        for (std::uint64_t k = random() % 12; k > 0; --k) keys.insert(key(random() % 40 * 100));
        wish(*lists[random() % 2], {keys.begin(), keys.end()});
        break;
      }
      case 1:
        for (const RangeKey& taken : table_.take_next(random() % 2 * kRoom, {}))
          EXPECT_TRUE(under_way.insert(taken).second) << "twice under way";
        break;
      case 2:
      case 3:
        if (!under_way.empty()) {
          const RangeKey done = *under_way.begin();
          under_way.erase(under_way.begin());
          if (random() % 4 == 0)
            table_.fail(done, {ErrorKind::kSystem, {.what = "x"}});
          else
            table_.put(done, bytes(100));
        }
        break;
      default: {
        const RangeKey urgent = key(random() % 40 * 100);
        ++table_.at(urgent).waiting;
        table_.want_now(urgent);
        --table_.at(urgent).waiting;
      }
    }
    std::uint64_t unwished = 0;
    for (std::uint64_t k = 0; k < 40; ++k)
      if (const RangeEntry* entry = table_.find(key(k * 100)))
        unwished += entry->state == RangeState::kHere && entry->wishes == 0 ? 100 : 0;
    ASSERT_LE(unwished, 1000u);
  }
}

}  // namespace
}  // namespace cairn::formats
