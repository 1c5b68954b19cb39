#include "stages/cluster/cluster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <random>

#include "formats/dataset/digest.h"
#include "formats/scalar_value.h"
#include "formats/wide_int.h"
#include "stages/parallel.h"
#include "tests/support/stage_fixture.h"

namespace cairn::stages {
namespace {

using formats::DatasetHeader;
using formats::GridPoint;
using formats::Int128;
using formats::NodeId;
using formats::ReduceRule;
using formats::ScalarType;
using formats::Tree;

struct InputPoint {
  GridPoint position;
  std::uint16_t intensity;
  std::uint8_t kind;
  std::array<float, 3> normal;
};

class CollectingSink final : public NodeSink {
 public:
  void take(ClusteredNode&& node) override {
    const std::lock_guard lock(mutex_);
    nodes.resize(std::max<std::size_t>(nodes.size(), value_of(node.id) + 1));
    nodes[value_of(node.id)] = std::move(node);
  }
  void save(formats::NodeId, StateWriter&) const override {}
  bool restore(formats::NodeId, StateReader&) override { return false; }
  std::vector<ClusteredNode> nodes;

 private:
  std::mutex mutex_;
};

class ClusterTest : public test::StageFixture {
 protected:
  DatasetHeader header_for(std::size_t count, std::uint32_t fanout,
                           std::uint64_t node_points) const {
    DatasetHeader header;
    header.grid.step = {0.5, 0.25, 1.0};
    header.points = count;
    header.fanout = fanout;
    header.target_points = node_points;
    header.schema = {{"intensity", ScalarType::kU16, 1, ReduceRule::kMean},
                     {"classification", ScalarType::kU8, 1, ReduceRule::kMajority},
                     {"normal", ScalarType::kF32, 3, ReduceRule::kNormal}};
    return header;
  }

  /// Clusters points that stand in kd-order already (any order will do for what is tested).
  std::vector<ClusteredNode> run(const std::vector<InputPoint>& points, const DatasetHeader& header,
                                 std::string_view reducer, ClusterOptions options = {}) {
    const std::size_t stride = formats::RecordLayout(header.schema, 12).stride;
    formats::ExternalArray records = formats::ExternalArray::in_memory(points.size() * stride);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::byte* record = records.bytes().data() + i * stride;
      std::memcpy(record, points[i].position.data(), 12);
      std::memcpy(record + 12, &points[i].intensity, 2);
      std::memcpy(record + 14, &points[i].kind, 1);
      std::memcpy(record + 15, points[i].normal.data(), 12);
    }
    CollectingSink sink;
    const auto reduce = make_reducer(reducer, options);
    cluster({records, stride, header, *reduce, options.grid}, sink, context());
    return std::move(sink.nodes);
  }
};

std::vector<InputPoint> random_cloud(std::size_t count, std::int32_t range, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> component(-1, 1);
  std::vector<InputPoint> points(count);
  for (InputPoint& p : points) {
    for (auto& c : p.position)
      c = static_cast<std::int32_t>(random() % static_cast<unsigned>(range)) - range / 2;
    p.intensity = static_cast<std::uint16_t>(random());
    p.kind = static_cast<std::uint8_t>(random() % 3);
    p.normal = {component(random), component(random), component(random)};
  }
  return points;
}

/// For every node and every stored point the input points that it stands for, by following the
/// assignments upwards from the leaves.
std::vector<std::vector<std::vector<std::size_t>>> follow(const std::vector<ClusteredNode>& nodes,
                                                          const Tree& tree,
                                                          const std::vector<InputPoint>& input) {
  std::vector<std::vector<std::vector<std::size_t>>> stands_for(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) stands_for[n].resize(nodes[n].points.count());
  for (std::size_t n = nodes.size(); n-- > 0;) {
    const NodeId id{n};
    if (tree.is_leaf(id)) {
      // A leaf's points are some permutation of its input range: match them by position and values.
      const auto range = tree.input_range(tree.leaf_level(), tree.index_on_level(id));
      std::vector<bool> used(range.count);
      for (std::size_t i = 0; i < nodes[n].points.count(); ++i)
        for (std::size_t k = 0; k < range.count; ++k) {
          std::uint16_t intensity;
          std::memcpy(&intensity, nodes[n].points.attributes[0].data() + 2 * i, 2);
          if (used[k] || input[range.first + k].position != nodes[n].points.position[i] ||
              input[range.first + k].intensity != intensity)
            continue;
          used[k] = true;
          stands_for[n][i].push_back(range.first + k);
          break;
        }
    }
    if (n == 0) continue;
    auto& parent = stands_for[value_of(tree.parent(id))];
    for (std::size_t i = 0; i < nodes[n].points.count(); ++i) {
      auto& members = parent.at(nodes[n].points.representative[i]);
      members.insert(members.end(), stands_for[n][i].begin(), stands_for[n][i].end());
    }
  }
  return stands_for;
}

std::int64_t rounded_mean(Int128 sum, std::int64_t count) {
  // floor(sum / count + 1/2) by exact integers.
  Int128 q = (2 * sum + count) / (2 * count);
  if ((2 * sum + count) % (2 * count) < 0) --q;
  return static_cast<std::int64_t>(q);
}

/// Holds the representatives of an inner node to integer arithmetic on the input points that they stand for.
void expect_exact(const ClusteredNode& node, const DatasetHeader& header,
                  const std::vector<std::vector<std::size_t>>& stands_for,
                  const std::vector<InputPoint>& input) {
  std::uint64_t total = 0;
  Int128 squared_steps[3] = {};
  double farthest = 0;
  for (std::size_t i = 0; i < node.points.count(); ++i) {
    const auto& members = stands_for[i];
    const auto count = static_cast<std::int64_t>(members.size());
    const GridPoint& mean = node.points.position[i];
    ASSERT_EQ(node.points.weight[i], members.size());
    total += members.size();
    Int128 sum[3] = {}, intensity = 0;
    for (const std::size_t m : members) {
      for (int axis = 0; axis < 3; ++axis) {
        sum[axis] += input[m].position[axis];
        const std::int64_t d = std::int64_t{input[m].position[axis]} - mean[axis];
        squared_steps[axis] += static_cast<Int128>(d) * d;
      }
      intensity += input[m].intensity;
      farthest =
          std::max(farthest, std::sqrt(squared_distance(header.grid, input[m].position, mean)));
    }
    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(mean[axis], rounded_mean(sum[axis], count));
    ASSERT_EQ(formats::load_scalar(node.points.attributes[0].data() + 2 * i, ScalarType::kU16),
              static_cast<double>(rounded_mean(intensity, count)));
  }
  ASSERT_EQ(total, node.weight);
  // The steps are powers of two: the only roundings are those of three sums to doubles, and of adding them up.
  long double squared = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    squared += static_cast<long double>(squared_steps[axis]) * header.grid.step[axis] *
               header.grid.step[axis];
  ASSERT_NEAR(node.squared_error, static_cast<double>(squared),
              1e-15 * static_cast<double>(squared));
  ASSERT_GE(node.bound, farthest);
}

void expect_exact(const std::vector<ClusteredNode>& nodes, const DatasetHeader& header,
                  const std::vector<InputPoint>& input) {
  const Tree tree = header.tree();
  ASSERT_EQ(nodes.size(), tree.node_count());
  const auto stands_for = follow(nodes, tree, input);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (tree.is_leaf(NodeId{n})) continue;
    ASSERT_EQ(nodes[n].points.count(), tree.node_points());
    ASSERT_NO_FATAL_FAILURE(expect_exact(nodes[n], header, stands_for[n], input));
  }
}

TEST_F(ClusterTest, RepresentativesAreExactMeansOverInputPointsOnEveryLevel) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    const auto input = random_cloud(300 + 37 * seed, seed % 3 == 0 ? 12 : 1 << 20, seed);
    const DatasetHeader header = header_for(input.size(), 2 + seed % 3, 40);
    ASSERT_NO_FATAL_FAILURE(expect_exact(run(input, header, "cluster"), header, input)) << seed;
  }
}

TEST_F(ClusterTest, TenThousandSmallCloudsAreExactToo) {
  constexpr std::int32_t kRanges[] = {1, 2, 5, 1000, 1 << 20, INT32_MAX};
  for (unsigned seed = 0; seed < 10'000; ++seed) {
    const auto input = random_cloud(2 + seed % 79, kRanges[seed % std::size(kRanges)], seed);
    const DatasetHeader header = header_for(input.size(), 2 + seed % 4, 5 + seed % 5);
    ASSERT_NO_FATAL_FAILURE(expect_exact(run(input, header, "cluster"), header, input)) << seed;
  }
}

TEST_F(ClusterTest, EveryReducerGivesUniformNodesAndConservesWeight) {
  const auto input = random_cloud(5000, 1 << 16, 3);
  for (const std::string_view reducer : reducer_names()) {
    const DatasetHeader header = header_for(input.size(), 4, 300);
    const Tree tree = header.tree();
    const auto nodes = run(input, header, reducer);
    std::vector<std::uint64_t> weight_on(tree.leaf_level() + 1);
    for (const ClusteredNode& node : nodes) {
      EXPECT_EQ(node.points.count(), tree.stored_points(node.id)) << reducer;
      std::uint64_t sum = node.points.weight.empty() ? node.points.count() : 0;
      for (const std::uint64_t w : node.points.weight) sum += w;
      EXPECT_EQ(sum, node.weight);
      weight_on[tree.level_of(node.id)] += sum;
    }
    for (const std::uint64_t weight : weight_on) EXPECT_EQ(weight, input.size());
  }
}

TEST_F(ClusterTest, SampledRepresentativesAreInputPoints) {
  const auto input = random_cloud(2000, 1 << 16, 8);
  const auto nodes = run(input, header_for(input.size(), 4, 200), "random");
  for (std::size_t i = 0; i < nodes[0].points.count(); ++i) {
    const bool found = std::any_of(input.begin(), input.end(), [&](const InputPoint& p) {
      return p.position == nodes[0].points.position[i] &&
             p.intensity == formats::load_scalar(nodes[0].points.attributes[0].data() + 2 * i,
                                                 ScalarType::kU16);
    });
    ASSERT_TRUE(found);
  }
}

TEST_F(ClusterTest, SpheresOfRepresentativesReachOverWhatTheyStandFor) {
  const auto input = random_cloud(4000, 4000, 5);
  const DatasetHeader header = header_for(input.size(), 3, 250);
  const auto nodes = run(input, header, "cluster");
  const Tree tree = header.tree();
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    const ClusteredNode& parent = nodes[value_of(tree.parent(NodeId{n}))];
    for (std::size_t i = 0; i < nodes[n].points.count(); ++i) {
      const std::uint32_t r = nodes[n].points.representative[i];
      const double distance = std::sqrt(
          squared_distance(header.grid, nodes[n].points.position[i], parent.points.position[r]));
      ASSERT_GE(parent.reach[r], distance + nodes[n].points.radius[i]);
    }
  }
}

TEST_F(ClusterTest, BlocksHoldTheRepresentativesOfTheirChild) {
  const auto input = random_cloud(3000, 1 << 20, 6);
  const DatasetHeader header = header_for(input.size(), 5, 200);
  const Tree tree = header.tree();
  const auto nodes = run(input, header, "cluster");
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    const ClusteredNode& parent = nodes[value_of(tree.parent(NodeId{n}))];
    const std::size_t block = (n - 1) % 5;
    std::vector<bool> used(parent.points.count());
    for (const std::uint32_t r : nodes[n].points.representative) {
      ASSERT_GE(r, parent.block_start[block]);
      ASSERT_LT(r, parent.block_start[block + 1]);
      used[r] = true;
    }
    for (std::uint32_t r = parent.block_start[block]; r < parent.block_start[block + 1]; ++r)
      ASSERT_TRUE(used[r]);
    if (tree.is_leaf(NodeId{n})) {
      ASSERT_TRUE(std::is_sorted(nodes[n].points.representative.begin(),
                                 nodes[n].points.representative.end()));
    }
  }
}

TEST_F(ClusterTest, IdenticalPointsShareTheirWeightEvenly) {
  std::vector<InputPoint> input(4096, InputPoint{{3, 4, 5}, 9, 1, {0, 0, 1}});
  const auto nodes = run(input, header_for(input.size(), 4, 256), "cluster");
  for (const ClusteredNode& node : nodes) {
    if (node.points.weight.empty()) continue;
    const auto [low, high] =
        std::minmax_element(node.points.weight.begin(), node.points.weight.end());
    EXPECT_LE(*high, 2 * *low);
    EXPECT_EQ(node.squared_error, 0);
    EXPECT_EQ(node.bound, 0);
  }
}

TEST_F(ClusterTest, GivenGridOfEveryFinenessReachesTheQuota) {
  const auto input = random_cloud(2000, 1 << 20, 12);
  for (const std::uint32_t cells : {1U, 2U, 3U, 35U, 1000U, 65535U, 65536U}) {
    const DatasetHeader header = header_for(input.size(), 8, 100);
    const auto nodes = run(input, header, "cluster", {.grid = cells, .theta = {}});
    EXPECT_EQ(nodes[0].points.count(), header.tree().node_points()) << cells;
    EXPECT_LE(nodes[0].grid, cells);
  }
}

TEST_F(ClusterTest, CoincidentPointsOfNormalsThatAreNotQuiteUnitCollapseAtThetaZero) {
  // 1/sqrt(3) as a float, squared and added up, is less than 1.
  const float third = std::sqrt(1.0F / 3);
  std::vector<InputPoint> input;
  for (int i = 0; i < 64; ++i) input.push_back({{i / 2, 0, 0}, 0, 0, {third, third, third}});
  const auto root = run(input, header_for(input.size(), 2, 32), "cluster",
                        {.grid = 5, .theta = {0, 1.5F}, .refinement = 0})[0];
  EXPECT_EQ(root.points.count(), 32U);
  EXPECT_EQ(root.squared_error, 0);
  EXPECT_EQ(root.grid, 0U) << "no grid was needed";
}

TEST_F(ClusterTest, AChildThatNeedsNoGridLeavesThatOfItsSiblings) {
  // Of leaves with three points at each place a third is left once they have collapsed: as many as are asked for.
  constexpr int kLeafPoints = 24;
  for (const std::array<int, 3>& copies : {std::array{3, 1, 1}, {1, 3, 1}, {1, 1, 3}, {3, 3, 1}}) {
    std::vector<InputPoint> input;
    for (int leaf = 0; leaf < 3; ++leaf)
      for (int i = 0; i < kLeafPoints; ++i)
        input.push_back({{leaf * 1000 + i / copies[leaf] * 10, 0, 0}, 0, 0, {0, 0, 1}});
    const auto root = run(input, header_for(input.size(), 3, kLeafPoints), "cluster",
                          {.grid = 1, .theta = {}})[0];
    EXPECT_EQ(root.points.count(), 24U);
    EXPECT_EQ(root.grid, 1U);
  }
}

TEST_F(ClusterTest, AutoCountsPlacesAndNotPoints) {
  // Leaves of 16 points at each of 64 places in a row, of which 32 are asked for. A grid of 16 points a cell had one place
  // in each, where nothing is left to merge.
  constexpr int kLeaves = 32, kLeafPoints = 1024;
  std::vector<InputPoint> input;
  for (int i = 0; i < kLeaves * kLeafPoints; ++i)
    input.push_back({{i / 16 * 1000, 0, 0}, 0, 0, {0, 0, 1}});
  const auto nodes = run(input, header_for(input.size(), kLeaves, kLeafPoints), "cluster", {});
  EXPECT_EQ(nodes[0].points.count(), 1024U);
  EXPECT_GT(nodes[0].grid, 0U);
  EXPECT_EQ(nodes[0].numerics.coarsened_grid, 0U);
}

TEST_F(ClusterTest, CancellingNormalsGiveTheHeaviestMembers) {
  std::vector<InputPoint> input;
  for (int i = 0; i < 64; ++i)
    input.push_back({{i / 2, 0, 0}, 0, 0, {0, 0, i % 2 == 0 ? 1.0F : -1.0F}});
  const auto nodes =
      run(input, header_for(input.size(), 2, 16), "cluster", {.grid = {}, .theta = {180, 1.5F}});
  const auto stands_for = follow(nodes, header_for(input.size(), 2, 16).tree(), input);
  std::uint64_t cancelled = 0;
  for (std::size_t i = 0; i < nodes[0].points.count(); ++i) {
    float sum = 0;
    for (const std::size_t m : stands_for[0][i]) sum += input[m].normal[2];
    cancelled += sum == 0 ? 1 : 0;
    float n[3];
    std::memcpy(n, nodes[0].points.attributes[2].data() + 12 * i, 12);
    EXPECT_FLOAT_EQ(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1);
  }
  EXPECT_GT(cancelled, 0U);
  EXPECT_EQ(nodes[0].numerics.cancelled_normals, cancelled);
}

TEST_F(ClusterTest, RelaxedLimitsAreCounted) {
  // Two leaves of four pairs of opposite normals, each to become four points.
  std::vector<InputPoint> pairs, row;
  for (int i = 0; i < 16; ++i) {
    pairs.push_back({{i / 2, 0, 0}, 0, 0, {0, 0, i % 2 == 0 ? 1.0F : -1.0F}});
    row.push_back({{i, 0, 0}, 0, 0, {0, 0, 1}});
  }
  const auto root = [&](const std::vector<InputPoint>& input, std::uint32_t grid, float theta) {
    return run(input, header_for(input.size(), 2, 8), "cluster",
               {.grid = grid, .theta = {theta, 1.5F}})[0]
        .numerics;
  };
  // In one cell each point has neighbours that face the same way.
  EXPECT_EQ(root(pairs, 1, 15).relaxed_theta, 0U);
  EXPECT_EQ(root(pairs, 1, 15).coarsened_grid, 0U);
  // With a cell a place there is nothing to merge in a cell but the two opposite ones.
  EXPECT_EQ(root(pairs, 65536, 15).relaxed_theta, 2U);
  EXPECT_EQ(root(pairs, 65536, 15).cancelled_normals, 8U);
  EXPECT_EQ(root(pairs, 65536, 180).relaxed_theta, 0U);
  // With a cell a point there is nothing to merge in it at all.
  EXPECT_EQ(root(row, 65536, 15).coarsened_grid, 2U);
  EXPECT_EQ(root(row, 65536, 15).relaxed_theta, 0U);
}

TEST_F(ClusterTest, SameNodesFromOneAndManyThreads) {
  const auto input = random_cloud(30000, 1 << 20, 4);
  const DatasetHeader header = header_for(input.size(), 4, 500);
  std::vector<ClusteredNode> one, many;
  run_in_arena(1, [&] { one = run(input, header, "cluster"); });
  run_in_arena(7, [&] { many = run(input, header, "cluster"); });
  ASSERT_EQ(one.size(), many.size());
  for (std::size_t n = 0; n < one.size(); ++n) {
    EXPECT_EQ(one[n].points.position, many[n].points.position);
    EXPECT_EQ(one[n].points.representative, many[n].points.representative);
    EXPECT_EQ(one[n].points.attributes, many[n].points.attributes);
    EXPECT_EQ(one[n].points.radius, many[n].points.radius);
    EXPECT_EQ(one[n].bound, many[n].bound);
    EXPECT_EQ(one[n].digest, many[n].digest);
  }
}

}  // namespace
}  // namespace cairn::stages
