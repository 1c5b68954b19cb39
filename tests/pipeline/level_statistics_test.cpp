#include "pipeline/level_statistics.h"

#include <gtest/gtest.h>

#include <numeric>

namespace cairn::pipeline {
namespace {

std::uint64_t nodes_in(const std::vector<SizeClass>& classes) {
  return std::accumulate(classes.begin(), classes.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const SizeClass& c) { return sum + c.nodes; });
}

TEST(SizeClasses, FewSizesHaveAClassEach) {
  const auto classes = size_classes({7, 8, 8, 7, 8});
  ASSERT_EQ(classes.size(), 2U);
  EXPECT_EQ(classes[0].min, 7U);
  EXPECT_EQ(classes[0].max, 7U);
  EXPECT_EQ(classes[0].nodes, 2U);
  EXPECT_EQ(classes[1].nodes, 3U);
}

TEST(SizeClasses, ManySizesShareClassesOfEqualWidthAndNoneIsLost) {
  std::vector<std::uint64_t> sizes(1000);
  std::iota(sizes.begin(), sizes.end(), std::uint64_t{50});
  const auto classes = size_classes(sizes);
  ASSERT_LE(classes.size(), kMostClasses);
  EXPECT_EQ(nodes_in(classes), 1000U);
  EXPECT_EQ(classes.front().min, 50U);
  EXPECT_GE(classes.back().max, 1049U);
  for (std::size_t i = 1; i < classes.size(); ++i)
    EXPECT_EQ(classes[i].min, classes[i - 1].max + 1);
}

TEST(SizeClasses, TheLargestSizesDoNotOverflow) {
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t i = 0; i < 100; ++i) sizes.push_back(i * (std::uint64_t{1} << 18));
  EXPECT_EQ(nodes_in(size_classes(sizes)), 100U);
}

}  // namespace
}  // namespace cairn::pipeline
