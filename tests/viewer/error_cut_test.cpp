// The cut on a budget against what it must be: a cover, within its limits, finest where it was asked for.
#include "viewer/error_cut.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "formats/error.h"
#include "tests/support/random_tree.h"

namespace cairn::viewer {
namespace {

using Front = std::set<std::pair<NodeIndex, std::uint32_t>>;

LodTree random_tree(std::mt19937_64& random) {
  constexpr std::uint32_t kFanouts[] = {2, 3, 4, 5, 8};
  return tests::make_random_tree({.points = 1000 + random() % 40'000,
                                  .fanout = kFanouts[random() % std::size(kFanouts)],
                                  .target_points = 50 + random() % 400},
                                 random);
}

glm::dvec3 random_point(const Box& scene, std::mt19937_64& random) {
  glm::dvec3 point = scene.center;
  for (int axis = 0; axis < 3; ++axis)
    point[axis] += std::uniform_real_distribution(-1.5, 1.5)(random) * scene.half[axis];
  return point;
}

/// The distance of a point from a box, axis by axis.
double distance_to(const Box& box, const glm::dvec3& point) {
  double squares = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double beyond = std::fabs(point[axis] - box.center[axis]) - box.half[axis];
    squares += beyond > 0 ? beyond * beyond : 0;
  }
  return std::sqrt(squares);
}

/// The same cut the slow way: the best of all blocks looked for each time, counts summed up anew.
class SlowCut {
 public:
  SlowCut(const LodTree& tree, const ErrorCutLimits& limits) : tree_(tree), limits_(limits) {
    for (std::uint32_t block = 0; block < tree.blocks(0); ++block) front.insert({0, block});
    while (true) {
      const std::pair<NodeIndex, std::uint32_t>* best = nullptr;
      for (const auto& entry : front)
        if (!tree.is_leaf(entry.first) && (best == nullptr || priority(entry) > priority(*best)))
          best = &entry;
      if (best == nullptr) return;
      Front next = front;
      next.erase(*best);
      const NodeIndex child = tree.child(best->first, best->second);
      for (std::uint32_t block = 0; block < tree.blocks(child); ++block)
        next.insert({child, block});
      if (points_of(next) > limits.points) return;
      front = next;
    }
  }
  std::uint64_t points_of(const Front& blocks) const {
    std::uint64_t points = 0;
    for (const auto& [node, block] : blocks) points += tree_.block(node, block).count;
    return points;
  }

  Front front;

 private:
  double priority(const Front::value_type& entry) const {
    const double bound = tree_.node(entry.first).bound;
    if (!limits_.focus) return bound;
    const double distance =
        distance_to(tree_.node(tree_.child(entry.first, entry.second)).box, limits_.focus->point);
    return distance <= limits_.focus->radius ? INFINITY : bound / distance;
  }

  const LodTree& tree_;
  const ErrorCutLimits& limits_;
};

Front front_of(const ErrorCut& cut) {
  Front front;
  for (const FrontBlock& block : cut.front) front.insert({block.node, block.block});
  return front;
}

std::uint32_t times_covered(const LodTree& tree, const ErrorCut& cut, NodeIndex leaf) {
  Selection selection;
  selection.front = cut.front;
  return tests::times_covered(tree, selection, leaf);
}

NodeIndex first_leaf(const LodTree& tree) {
  NodeIndex leaf = 0;
  while (!tree.is_leaf(leaf)) ++leaf;
  return leaf;
}

class ErrorCutTest : public testing::TestWithParam<unsigned> {
 protected:
  std::mt19937_64 random_{GetParam()};
};

TEST_P(ErrorCutTest, IsTheCutOfTheSlowWayAndCoversEveryLeafOnce) {
  for (int turn = 0; turn < 4; ++turn) {
    const LodTree tree = random_tree(random_);
    ErrorCutLimits limits{.points = tree.node(0).points + random_() % tree.shape().points()};
    if (turn % 2 == 1) limits.focus = Focus{.point = random_point(tree.node(0).box, random_)};
    const ErrorCut cut = select_by_error(tree, limits);
    const SlowCut slow(tree, limits);
    EXPECT_TRUE(front_of(cut) == slow.front);
    EXPECT_EQ(cut.points, slow.points_of(slow.front));
    EXPECT_LE(cut.points, limits.points);
    if (!cut.finest) EXPECT_GT(cut.points + tree.node_points(), limits.points);
    for (NodeIndex leaf = first_leaf(tree); leaf < tree.size(); ++leaf)
      ASSERT_EQ(times_covered(tree, cut, leaf), 1U);
  }
}

TEST_P(ErrorCutTest, HoldsAllWithinTheRadiusOrTellsWhatThatTakes) {
  const LodTree tree = random_tree(random_);
  const Box& scene = tree.node(0).box;
  ErrorCutLimits limits{.points = tree.node(0).points,
                        .focus = Focus{.point = scene.center, .radius = 0.3 * scene.half.x}};
  std::uint64_t needed = limits.points;
  try {
    select_by_error(tree, limits);
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    const std::string text = error.what();
    needed = std::stoull(text.substr(text.find("that takes ") + 11));
  }
  limits.points = needed;
  const ErrorCut cut = select_by_error(tree, limits);
  EXPECT_EQ(cut.points, needed);
  const Front front = front_of(cut);
  std::uint64_t near = 0;
  for (NodeIndex leaf = first_leaf(tree); leaf < tree.size(); ++leaf)
    if (distance_to(tree.node(leaf).box, limits.focus->point) <= limits.focus->radius) {
      EXPECT_TRUE(front.contains({leaf, 0}));
      ++near;
    }
  EXPECT_GT(near, 0U);
  limits.points = needed - 1;
  EXPECT_THROW(select_by_error(tree, limits), formats::Error);
}

TEST_P(ErrorCutTest, DetailFallsWithTheDistance) {
  // Errors that the level alone tells, a quarter from one to the next.
  std::vector<formats::NodeRecord> records;
  const formats::Tree shape(30'000, 4, 100);
  const formats::Grid grid{.step = {0.01, 0.01, 0.01}};
  std::uniform_int_distribution<std::int32_t> place(-100'000, 100'000);
  for (std::uint64_t i = 0; i < shape.node_count(); ++i) {
    formats::NodeRecord record;
    record.id = formats::NodeId{i};
    record.box = {{-100'000, -100'000, -1000}, {100'000, 100'000, 1000}};
    if (i > 0) {  // a quadrant of the parent's
      const auto& parent = records[formats::value_of(shape.parent(record.id))].box;
      record.box = parent;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::int32_t middle = parent.min[axis] + (parent.max[axis] - parent.min[axis]) / 2;
        ((i - 1) >> axis & 1 ? record.box.min : record.box.max)[axis] = middle;
      }
    }
    record.point_count = static_cast<std::uint32_t>(shape.stored_points(record.id));
    record.block_start.assign(5, record.point_count);
    for (std::uint32_t b = 0; b < 4; ++b)
      record.block_start[b] =
          shape.is_leaf(record.id) && b > 0 ? record.point_count : b * record.point_count / 4;
    record.bound = std::pow(0.25, shape.level_of(record.id));
    records.push_back(record);
  }
  const LodTree tree(shape, grid, records);
  const glm::dvec3 point(0.01 * place(random_), 0.01 * place(random_), 0);
  for (const std::uint64_t budget : {1000U, 3000U, 9000U}) {
    const ErrorCut cut = select_by_error(tree, {.points = budget, .focus = Focus{.point = point}});
    std::vector<double> farthest_refined(shape.leaf_level() + 1, 0);
    std::vector<double> nearest_left(shape.leaf_level() + 1, INFINITY);
    for (const FrontBlock& block : cut.front) {
      for (NodeIndex in_use = block.node; in_use != 0; in_use = tree.parent(in_use)) {
        double& farthest = farthest_refined[tree.level_of(in_use) - 1];
        farthest = std::max(farthest, distance_to(tree.node(in_use).box, point));
      }
      if (tree.is_leaf(block.node)) continue;
      double& nearest = nearest_left[tree.level_of(block.node)];
      nearest =
          std::min(nearest, distance_to(tree.node(tree.child(block.node, block.block)).box, point));
    }
    EXPECT_FALSE(cut.finest);
    for (std::size_t level = 0; level < nearest_left.size(); ++level)
      EXPECT_LE(farthest_refined[level], nearest_left[level]) << level;
  }
}

TEST_P(ErrorCutTest, WithinABoxCountsOnlyWhatTouchesIt) {
  const LodTree tree = random_tree(random_);
  const Box& scene = tree.node(0).box;
  const Box within{.center = random_point(scene, random_), .half = 0.2 * scene.half};
  const ErrorCut cut = select_by_error(tree, {.within = within});
  // A region counts if its parent may draw it inside: up to its bound away, and below a region that counts itself.
  const auto is_near = [&](NodeIndex node) {
    for (; node != 0; node = tree.parent(node)) {
      const Box& box = tree.node(node).box;
      const double reach = tree.node(tree.parent(node)).bound;
      for (int axis = 0; axis < 3; ++axis)
        if (std::fabs(box.center[axis] - within.center[axis]) >
            box.half[axis] + within.half[axis] + reach)
          return false;
    }
    return true;
  };
  std::uint64_t near = 0;
  for (NodeIndex leaf = first_leaf(tree); leaf < tree.size(); ++leaf) {
    EXPECT_EQ(times_covered(tree, cut, leaf), is_near(leaf) ? 1U : 0U);
    near += is_near(leaf) ? tree.node(leaf).points : 0;
  }
  EXPECT_EQ(cut.points, near);
}

TEST(ErrorCut, RefusesABudgetBelowTheCoarsestNode) {
  std::mt19937_64 random(1);
  const LodTree tree = random_tree(random);
  EXPECT_THROW(select_by_error(tree, {.points = tree.node(0).points - 1}), formats::Error);
  EXPECT_EQ(select_by_error(tree, {.points = tree.node(0).points}).points, tree.node(0).points);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ErrorCutTest, testing::Range(1U, 9U));

}  // namespace
}  // namespace cairn::viewer
