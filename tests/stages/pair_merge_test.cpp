#include "stages/cluster/pair_merge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace cairn::stages {
namespace {

MergeList random_list(std::mt19937& random, std::uint32_t count, bool normals) {
  std::uniform_real_distribution<float> coordinate(-1, 1);
  MergeList list;
  list.count = count;
  for (std::uint32_t i = 0; i < count; ++i) {
    list.x[i] = coordinate(random);
    list.y[i] = coordinate(random);
    list.z[i] = coordinate(random);
    list.weight[i] = static_cast<float>(1 + random() % 5);
    list.area[i] = static_cast<float>(1 + random() % 5);
    list.cost[i] = 0;
    const float a = normals ? coordinate(random) * 3.1F : 0,
                b = normals ? coordinate(random) * 1.5F : 0;
    list.nx[i] = normals ? std::cos(a) * std::cos(b) : 0;
    list.ny[i] = normals ? std::sin(a) * std::cos(b) : 0;
    list.nz[i] = normals ? std::sin(b) : 0;
    list.id[i] = 100 + i;
  }
  return list;
}

TEST(MergePairs, ReachesEveryTargetExactly) {
  std::mt19937 random(1);
  // Short lists all, of the longer ones some: 40, 67, ..., 256.
  for (std::uint32_t count = 1; count <= kMaxListLength; count += count < 40 ? 1 : 27)
    for (std::uint32_t target = 1; target <= count; target += count < 40 ? 1 : 13) {
      MergeList list = random_list(random, count, count % 2 == 0);
      const MergeOutcome outcome = merge_pairs(list, target, {});
      ASSERT_EQ(outcome.count, count - target);
      std::set<std::uint32_t> losers;
      for (std::uint32_t k = 0; k < outcome.count; ++k) {
        ASSERT_LT(outcome.merges[k].winner, outcome.merges[k].loser);
        ASSERT_TRUE(losers.insert(outcome.merges[k].loser).second);
        ASSERT_FALSE(losers.contains(outcome.merges[k].winner));
      }
    }
}

TEST(MergePairs, FirstMergeIsTheCheapestPairOfAll) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 500; ++trial) {
    MergeList list = random_list(random, 2 + random() % 31, false);
    // Ward's cost by brute force, in double precision.
    double cheapest = INFINITY;
    std::uint32_t best_a = 0, best_b = 0;
    for (std::uint32_t a = 0; a < list.count; ++a)
      for (std::uint32_t b = a + 1; b < list.count; ++b) {
        const double dx = list.x[a] - list.x[b], dy = list.y[a] - list.y[b],
                     dz = list.z[a] - list.z[b];
        const double area_a = list.area[a], area_b = list.area[b];
        const double cost = area_a * area_b / (area_a + area_b) * (dx * dx + dy * dy + dz * dz);
        if (cost < cheapest) {
          cheapest = cost;
          best_a = a;
          best_b = b;
        }
      }
    const std::uint32_t id_a = list.id[best_a], id_b = list.id[best_b];
    const MergeOutcome outcome = merge_pairs(list, list.count - 1, {});
    ASSERT_EQ(outcome.merges[0].winner, id_a);
    ASSERT_EQ(outcome.merges[0].loser, id_b);
  }
}

TEST(MergePairs, AMergeCostsNoLessThanThoseThatItBuildsOn) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    MergeList list = random_list(random, kMaxListLength, trial % 2 == 0);
    const MergeOutcome outcome = merge_pairs(list, 1, {});
    std::map<std::uint32_t, float> cost_of;  // of the last merge into a cluster
    for (std::uint32_t k = 0; k < outcome.count; ++k) {
      const Merge& merge = outcome.merges[k];
      ASSERT_TRUE(std::isfinite(merge.cost));
      ASSERT_GE(merge.cost, cost_of[merge.winner]);
      ASSERT_GE(merge.cost, cost_of[merge.loser]);
      cost_of[merge.winner] = merge.cost;
    }
  }
}

TEST(MergePairs, PointsAtEqualDistancesMergeInPairsAtOnce) {
  MergeList list{};
  list.count = kMaxListLength;
  for (std::uint32_t i = 0; i < list.count; ++i) {
    list.x[i] = static_cast<float>(i);
    list.weight[i] = list.area[i] = 1;
    list.id[i] = i;
  }
  const MergeOutcome outcome = merge_pairs(list, 1, {});
  EXPECT_EQ(outcome.rounds, 8U) << "256 points halved eight times";
  for (std::uint32_t k = 0; k < kMaxListLength / 2; ++k) {
    EXPECT_EQ(outcome.merges[k].winner, 2 * k);
    EXPECT_EQ(outcome.merges[k].loser, 2 * k + 1);
  }
}

TEST(MergePairs, KeepsOppositeSheetsApartWhileThetaForbidsIt) {
  // Two sheets of 16 points, a hair apart, facing opposite ways.
  MergeList list{};
  list.count = 32;
  for (std::uint32_t i = 0; i < 32; ++i) {
    list.x[i] = static_cast<float>(i / 2 % 4);
    list.y[i] = static_cast<float>(i / 8);
    list.z[i] = i % 2 == 0 ? 0.0F : 0.001F;
    list.weight[i] = list.area[i] = 1;
    list.nx[i] = list.ny[i] = 0;
    list.nz[i] = i % 2 == 0 ? 1.0F : -1.0F;
    list.id[i] = i;
  }
  const MergeOutcome outcome = merge_pairs(list, 2, {15, 1.5F});
  for (std::uint32_t k = 0; k < outcome.count; ++k)
    EXPECT_EQ(outcome.merges[k].winner % 2, outcome.merges[k].loser % 2);
  EXPECT_EQ(outcome.merges[outcome.count - 1].theta_degrees, 15);
  EXPECT_EQ(list.nz[0], 1);
  EXPECT_EQ(list.nz[1], -1);
}

TEST(MergePairs, RelaxesThetaOnlyAsFarAsNeeded) {
  MergeList list{};
  list.count = 2;
  for (std::uint32_t i = 0; i < 2; ++i) {
    list.x[i] = static_cast<float>(i);
    list.y[i] = list.z[i] = 0;
    list.weight[i] = list.area[i] = 1;
    const float angle = static_cast<float>(i) * 40.0F * 3.14159265F / 180.0F;
    list.nx[i] = std::cos(angle);
    list.ny[i] = std::sin(angle);
    list.nz[i] = 0;
    list.id[i] = i;
  }
  // 15, 22.5, 33.75, 50.625: the first that 40 degrees fit into.
  const Merge merge = merge_pairs(list, 1, {15, 1.5F}).merges[0];
  EXPECT_FLOAT_EQ(merge.theta_degrees, 50.625F);
  // Half the squared distance, times the relaxation's square three times, but for the bits that hold an index.
  EXPECT_NEAR(merge.cost, 0.5 * std::pow(1.5, 6), 1e-4);
}

TEST(MergePairs, EveryStepThatRelaxesThetaCosts) {
  // A factor near 1 grows theta by a degree a round: what counts is how far it came.
  MergeList list{};
  list.count = 2;
  for (std::uint32_t i = 0; i < 2; ++i) {
    list.x[i] = static_cast<float>(i);
    list.weight[i] = list.area[i] = 1;
    list.ny[i] = i == 0 ? 1.0F : -1.0F;
    list.id[i] = i;
  }
  for (const float start : {0.0F, 1.0F, 15.0F}) {
    MergeList copy = list;
    const Merge merge = merge_pairs(copy, 1, {start, 1.001F}).merges[0];
    EXPECT_EQ(merge.theta_degrees, 180);
    EXPECT_NEAR(merge.cost, 0.5 * std::pow(180 / std::max(start, 1.0F), 2), 0.001 * merge.cost);
  }
}

TEST(MergePairs, MissingNormalsBlockNothing) {
  std::mt19937 random(5);
  MergeList list = random_list(random, 20, true);
  for (std::uint32_t i = 0; i < 20; i += 2) list.nx[i] = list.ny[i] = list.nz[i] = 0;
  EXPECT_EQ(merge_pairs(list, 1, {0, 1.5F}).count, 19U);
}

TEST(MergePairs, EndsWhereEqualCostsRoundDifferently) {
  // Weights 1, 6, 3 at these places make all three pairs cost exactly the same.
  const int at[3][3] = {{3, 4, 2}, {4, 0, 4}, {1, 0, 4}};
  const float weight[3] = {1, 6, 3};
  MergeList list{};
  list.count = 3;
  for (std::uint32_t i = 0; i < 3; ++i) {
    list.x[i] = 2.4052999F * static_cast<float>(at[i][0] - at[0][0]);
    list.y[i] = 2.4052999F * static_cast<float>(at[i][1] - at[0][1]);
    list.z[i] = 2.4052999F * static_cast<float>(at[i][2] - at[0][2]);
    list.weight[i] = list.area[i] = weight[i];
    list.id[i] = i;
  }
  EXPECT_EQ(merge_pairs(list, 2, {}).count, 1U);
}

TEST(MergePairs, EndsWithTheSmallestRelaxation) {
  MergeList list{};
  list.count = 2;
  for (std::uint32_t i = 0; i < 2; ++i) {
    list.x[i] = static_cast<float>(i);
    list.weight[i] = list.area[i] = 1;
    list.id[i] = i;
  }
  list.nx[0] = 1;
  list.ny[1] = 1;
  // A step of less than a degree counts as one: 15, 16, ... 90.
  EXPECT_FLOAT_EQ(merge_pairs(list, 1, {15, 1.00000001F}).merges[0].theta_degrees, 90);
}

}  // namespace
}  // namespace cairn::stages
