#include "stages/split/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>

#include "stages/import/import.h"
#include "stages/parallel.h"
#include "tests/support/dying_log.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::GridBox;
using formats::GridPoint;
using formats::Tree;

/// A record of the test's campaigns: grid position and a number that names the point.
struct NumberedPoint {
  GridPoint position;
  std::uint32_t number;
};
static_assert(sizeof(NumberedPoint) == 16);

std::vector<NumberedPoint> records_of(const SplitPoints& points) {
  std::vector<NumberedPoint> records(points.array.size_bytes() / sizeof(NumberedPoint));
  std::memcpy(records.data(), points.array.bytes().data(), points.array.size_bytes());
  return records;
}

/// The split told in the plainest way: sort every node by (coordinate on its longest axis, order in the
/// parent) and cut.
void split_by_sorting(std::span<NumberedPoint> node, const Tree& tree, formats::Level level,
                      std::uint64_t index) {
  if (level == tree.leaf_level()) return;
  GridBox box;
  for (const NumberedPoint& p : node) box.add(p.position);
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (box.span(static_cast<int>(a)) > box.span(static_cast<int>(axis))) axis = a;
  std::stable_sort(node.begin(), node.end(),
                   [axis](const NumberedPoint& a, const NumberedPoint& b) {
                     return a.position[axis] < b.position[axis];
                   });
  const std::uint64_t first = tree.input_range(level, index).first;
  for (std::uint64_t i = 0; i < tree.fanout(); ++i) {
    const auto child = tree.input_range(level + 1, index * tree.fanout() + i);
    split_by_sorting(node.subspan(child.first - first, child.count), tree, level + 1,
                     index * tree.fanout() + i);
  }
}

/// The points of each leaf, in the order of their numbers: a stable scatter keeps the order of arrival
/// where sorting by coordinate does not, so leaves are compared as sets.
std::vector<std::vector<std::uint32_t>> leaf_sets(std::span<const NumberedPoint> points,
                                                  const Tree& tree) {
  std::vector<std::vector<std::uint32_t>> leaves;
  for (std::uint64_t i = 0; i < tree.nodes_on(tree.leaf_level()); ++i) {
    const auto range = tree.input_range(tree.leaf_level(), i);
    auto& leaf = leaves.emplace_back();
    for (const NumberedPoint& p : points.subspan(range.first, range.count))
      leaf.push_back(p.number);
    std::sort(leaf.begin(), leaf.end());
  }
  return leaves;
}

class SplitTest : public test::StageFixture {
 protected:
  SplitPoints run(const std::vector<NumberedPoint>& points, const Tree& tree) {
    formats::PointBlock block;
    block.count = points.size();
    block.columns.resize(1);
    for (const NumberedPoint& p : points) {
      block.steps.push_back(p.position);
      const auto bytes = std::as_bytes(std::span(&p.number, 1));
      block.columns[0].insert(block.columns[0].end(), bytes.begin(), bytes.end());
    }
    Scans scans;
    scans.push_back(test::steps_scan(
        {{"number", formats::ScalarType::kU32, 1, formats::ReduceRule::kNone}}, {block}));
    return split(import_scans(scans, {}, context()), tree, context());
  }
};

std::vector<NumberedPoint> random_points(std::size_t count, std::uint32_t range, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<NumberedPoint> points(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto coordinate = [&] { return static_cast<std::int32_t>(random() % range); };
    points[i] = {{coordinate(), coordinate(), coordinate()}, i};
  }
  return points;
}

TEST_F(SplitTest, LeavesAreThoseOfSortingEveryNode) {
  for (const std::uint32_t fanout : {2U, 3U, 7U, 64U})
    for (const std::uint32_t range : {1U << 20, 1000U, 5U}) {
      const auto points = random_points(20000, range, fanout);
      const Tree tree(points.size(), fanout, 300);
      const SplitPoints result = run(points, tree);
      auto expected = points;
      // The grid's shift moves all coordinates alike, which changes no comparison.
      split_by_sorting(expected, tree, 0, 0);
      const auto got = records_of(result);
      if (range == 1U << 20) {
        EXPECT_EQ(leaf_sets(got, tree), leaf_sets(expected, tree)) << fanout;
      }
      std::vector<std::uint32_t> numbers;
      for (const auto& p : got) numbers.push_back(p.number);
      std::sort(numbers.begin(), numbers.end());
      for (std::uint32_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], i);
    }
}

TEST_F(SplitTest, ChildrenOfEveryNodeMeetOnOnePlane) {
  const auto points = random_points(50000, 300, 9);
  const Tree tree(points.size(), 4, 1000);
  const auto got = records_of(run(points, tree));
  for (formats::Level level = 0; level < tree.leaf_level(); ++level)
    for (std::uint64_t node = 0; node < tree.nodes_on(level); ++node) {
      const auto range = tree.input_range(level, node);
      GridBox box;
      for (std::uint64_t i = range.first; i < range.end(); ++i) box.add(got[i].position);
      std::size_t axis = 0;
      for (std::size_t a = 1; a < 3; ++a)
        if (box.span(static_cast<int>(a)) > box.span(static_cast<int>(axis))) axis = a;
      std::int32_t reached = INT32_MIN;
      for (std::uint64_t i = 0; i < 4; ++i) {
        const auto child = tree.input_range(level + 1, 4 * node + i);
        std::int32_t low = INT32_MAX, high = INT32_MIN;
        for (std::uint64_t p = child.first; p < child.end(); ++p) {
          low = std::min(low, got[p].position[axis]);
          high = std::max(high, got[p].position[axis]);
        }
        ASSERT_GE(low, reached);
        reached = high;
      }
    }
}

TEST_F(SplitTest, IdenticalPointsStillSplitEvenlyInOrderOfArrival) {
  const std::vector<NumberedPoint> points = [] {
    std::vector<NumberedPoint> same(100000);
    for (std::uint32_t i = 0; i < same.size(); ++i) same[i] = {{5, 5, 5}, i};
    return same;
  }();
  const auto got = records_of(run(points, Tree(points.size(), 5, 1000)));
  for (std::uint32_t i = 0; i < got.size(); ++i) ASSERT_EQ(got[i].number, i);
}

TEST_F(SplitTest, OnePointAndOneLeafAreJustMapped) {
  const auto got = records_of(run({{{-7, 8, 9}, 42}}, Tree(1, 2, 100)));
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].number, 42U);
  EXPECT_EQ(got[0].position, (GridPoint{0, 0, 0}));  // the smallest coordinate becomes step 0
}

TEST_F(SplitTest, SameBytesFromAnyThreadsAndWithTinyMemory) {
  const auto points =
      random_points(1 << 21, 700, 4);  // large enough for the parallel pass, with many ties
  const Tree tree(points.size(), 3, 20000);
  const auto with = [&](unsigned threads, std::uint64_t memory) {
    context().memory_bytes = memory;
    std::vector<NumberedPoint> result;
    run_in_arena(threads, [&] { result = records_of(run(points, tree)); });
    return result;
  };
  const auto bytes = [](const std::vector<NumberedPoint>& records) {
    return std::string_view(reinterpret_cast<const char*>(records.data()),
                            records.size() * sizeof(NumberedPoint));
  };
  const auto one = with(1, std::uint64_t{1} << 30);
  EXPECT_EQ(bytes(one), bytes(with(2, std::uint64_t{1} << 30)));
  EXPECT_EQ(bytes(one), bytes(with(7, std::uint64_t{1} << 20)));
}

/// Counts what is told, and asks for a stop at the first points of the split.
class StoppingProgress final : public ProgressSink {
 public:
  explicit StoppingProgress(std::stop_source& stop) : stop_(stop) {}
  void begin(std::string_view stage, std::uint64_t total) override {
    splitting_ = stage == "split";
    total_ = total;
  }
  void advance(std::uint64_t points) override {
    if (!splitting_) return;
    told_ += points;
    stop_.request_stop();
  }
  void end() override {}

  std::uint64_t total() const { return total_; }
  std::uint64_t told() const { return told_; }

 private:
  std::stop_source& stop_;
  std::atomic<bool> splitting_ = false;
  std::atomic<std::uint64_t> total_ = 0;
  std::atomic<std::uint64_t> told_ = 0;
};

TEST_F(SplitTest, TellsEveryPointOfEveryLevelAndStopsWithinTheRootPass) {
  const auto points = random_points(1 << 21, 700, 5);
  const Tree tree(points.size(), 2, points.size() / 4);
  ASSERT_EQ(tree.leaf_level(), 2);
  std::stop_source stop;
  StoppingProgress progress(stop);
  context().progress = &progress;
  run(points, tree);
  EXPECT_EQ(progress.total(), 2 * points.size());
  EXPECT_EQ(progress.told(), 2 * points.size());

  stop = std::stop_source{};
  StoppingProgress stopped(stop);
  context().progress = &stopped;
  context().stop = stop.get_token();
  EXPECT_THROW(run(points, tree), Stopped);
  EXPECT_LT(stopped.told(), points.size());
}

/// Work arrays that stay, as those of a build do.
void keep_arrays(Context& context, const std::filesystem::path& folder) {
  context.make_array = [=](std::string_view name, std::uint64_t size_bytes) {
    std::filesystem::remove(folder / name);
    return formats::ExternalArray(folder / name, size_bytes);
  };
  context.find_array = [=](std::string_view name, std::uint64_t size_bytes) {
    return formats::ExternalArray::find(folder / name, size_bytes);
  };
}

TEST_F(SplitTest, GoesOnFromAnyUnitInMemoryAndOnDisk) {
  const auto points = random_points(12'000, 3000, 7);
  const Tree tree(points.size(), 3, 140);
  ASSERT_EQ(tree.leaf_level(), 4);
  const auto undisturbed = leaf_sets(records_of(run(points, tree)), tree);
  // All in memory; subtrees of level 2 and 3; nothing but leaves, which the last pass writes.
  for (const std::uint64_t memory_bytes : {1'000'000'000, 100'000, 30'000, 8'000}) {
    context().memory_bytes = memory_bytes;
    int deaths = 0;
    for (int units = 1;; units += units < 20 ? 1 : 7) {
      SCOPED_TRACE(std::to_string(memory_bytes) + " bytes, " + std::to_string(units));
      const std::string name = std::to_string(memory_bytes) + "-" + std::to_string(units);
      const std::filesystem::path place = folder() / name;
      std::filesystem::create_directory(place);
      keep_arrays(context(), place);
      test::DyingLog log;
      context().units = &log;
      log.die_after(units, units % 2 == 0);
      try {
        EXPECT_EQ(leaf_sets(records_of(run(points, tree)), tree), undisturbed);
        break;
      } catch (const test::Died&) {
        ++deaths;
      }
      log.die_after(1 + units / 2, units % 3 == 0);  // and once more, further on
      try {
        run(points, tree);
      } catch (const test::Died&) {
        ++deaths;
      }
      log.live_on();
      ASSERT_EQ(leaf_sets(records_of(run(points, tree)), tree), undisturbed);
      // Once more: all is done.
      const int finished = log.finished();
      ASSERT_EQ(leaf_sets(records_of(run(points, tree)), tree), undisturbed);
      ASSERT_EQ(log.finished(), finished);
      std::filesystem::remove_all(place);
    }
    EXPECT_GT(deaths, 8);
  }
}

TEST_F(SplitTest, WorkThatIsGoneOrDoesNotFitAnyMoreIsNotGoneOnWith) {
  const auto points = random_points(60'000, 3000, 7);
  const Tree tree(points.size(), 3, 700);
  keep_arrays(context(), folder().path());
  test::DyingLog log;
  context().units = &log;
  log.die_after(6, true);
  EXPECT_THROW(run(points, tree), test::Died);
  log.live_on();
  context().memory_bytes = 40'000;
  EXPECT_THROW(run(points, tree), WorkLost);
  context().memory_bytes = 1'000'000'000;
  std::filesystem::remove(folder() / "split-a");
  EXPECT_THROW(run(points, tree), WorkLost);
}

}  // namespace
}  // namespace cairn::stages
