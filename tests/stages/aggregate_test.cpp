// Aggregation where sums leave 32 and 64 bits, against exact integers.
#include "stages/cluster/aggregate.h"

#include <gtest/gtest.h>

#include <random>

namespace cairn::stages {
namespace {

using formats::Int128;

/// A node of points that stand for up to 2^50 input points each, anywhere on the grid.
WorkingNode heavy_node(std::mt19937_64& random) {
  WorkingNode node;
  const std::size_t count = 1 + random() % 7;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t weight = 1 + random() % (std::uint64_t{1} << (random() % 51));
    Steps residual;
    formats::GridPoint position;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position[axis] = static_cast<std::int32_t>(random());
      residual[axis] =
          static_cast<std::int64_t>(random() % weight) - static_cast<std::int64_t>(weight / 2);
    }
    node.data.position.push_back(position);
    node.data.weight.push_back(weight);
    node.data.radius.push_back(1);
    node.residual.push_back(residual);
    node.bound.push_back(0);
    node.reach.push_back(0);
  }
  return node;
}

/// The whole number nearest to a / b, the greater of two.
Int128 nearest(Int128 a, Int128 b) {
  Int128 quotient = (2 * a + b) / (2 * b);
  if ((2 * a + b) % (2 * b) < 0) --quotient;
  return quotient;
}

TEST(Aggregate, WeightsBeyond32BitsAreExact) {
  std::mt19937_64 random(1);
  for (int turn = 0; turn < 20'000; ++turn) {
    const WorkingNode node = heavy_node(random);
    const std::size_t count = node.count();
    const Reduction reduction{
        .representative = std::vector<std::uint32_t>(count, 0), .chosen = {}, .blend = {}};
    const std::vector<float> decoded_radius(count, 1);
    const WorkingNode share = aggregate({.node = node,
                                         .reduction = reduction,
                                         .quota = 1,
                                         .grid = {},
                                         .schema = {},
                                         .decoded_radius = decoded_radius,
                                         .displacement = 0});
    std::uint64_t weight = 0;
    for (const std::uint64_t w : node.data.weight) weight += w;
    ASSERT_EQ(share.data.weight[0], weight);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Int128 sum = 0;
      for (std::size_t i = 0; i < count; ++i)
        sum += static_cast<Int128>(node.data.weight[i]) * node.data.position[i][axis] +
               node.residual[i][axis];
      const std::int32_t mean = share.data.position[0][axis];
      ASSERT_TRUE(mean == nearest(sum, static_cast<Int128>(weight)));
      ASSERT_TRUE(share.residual[0][axis] == sum - static_cast<Int128>(weight) * mean);
      Int128 squares = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Int128 d = static_cast<Int128>(node.data.position[i][axis]) - mean;
        squares +=
            static_cast<Int128>(node.data.weight[i]) * d * d + 2 * d * node.residual[i][axis];
      }
      ASSERT_TRUE(static_cast<Int128>(share.squared_steps[axis]) == squares);
    }
  }
}

}  // namespace
}  // namespace cairn::stages
