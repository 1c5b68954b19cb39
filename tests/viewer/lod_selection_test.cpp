// The selected cut against what it must be: a cover, within its limits, and the one that figure 5 of the paper tells.
#include "viewer/lod_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "formats/error.h"
#include "tests/support/random_tree.h"

namespace cairn::viewer {
namespace {

using tests::is_visible;
using tests::make_random_tree;
using tests::random_camera;
using tests::RandomTreeShape;
using tests::times_covered;

constexpr PictureSize kSize{640, 400};

RandomTreeShape random_shape(std::mt19937_64& random) {
  constexpr std::uint32_t kFanouts[] = {2, 3, 4, 5, 8};
  return {.points = 1000 + random() % 40'000,
          .fanout = kFanouts[random() % std::size(kFanouts)],
          .target_points = 50 + random() % 400,
          .cones = random() % 2 == 0};
}

NodeIndex first_leaf(const LodTree& tree) {
  return static_cast<NodeIndex>(formats::value_of(tree.shape().id(tree.shape().leaf_level(), 0)));
}

/// Figure 5, refined by child, written the slow way: front blocks in a map, the best of all looked for each time, counts
/// summed up anew.
class SlowSelection {
 public:
  SlowSelection(const LodTree& tree, const View& view, const SelectionLimits& limits)
      : tree_(tree), view_(view), limits_(limits) {
    if (seen(0)) add(0, front_);
    while (true) {
      const auto best = std::max_element(front_.begin(), front_.end(), [&](auto& a, auto& b) {
        return std::pair(priority(a), b) < std::pair(priority(b), a);
      });
      if (best == front_.end() || priority(*best) < 0) return;
      Front next = front_;
      next.erase(*best);
      add(tree.child(best->first, best->second), next);
      if (count(next) > limits.points) return;
      front_ = next;
    }
  }

  using Front = std::set<std::pair<NodeIndex, std::uint32_t>>;
  const Front& front() const { return front_; }
  std::uint64_t points() const { return count(front_); }

 private:
  bool seen(NodeIndex region) const {
    const LodNode& node = tree_.node(region);
    return view_.may_see(node.box, node.reach) &&
           !(limits_.cull_back_faces && view_.faces_away(node.box, node.cone));
  }
  void add(NodeIndex node, Front& front) const {
    for (std::uint32_t block = 0; block < tree_.blocks(node); ++block)
      if (seen(tree_.region_of(node, block))) front.insert({node, block});
  }
  std::uint64_t count(const Front& front) const {
    std::uint64_t points = 0;
    for (const auto& [node, block] : front) points += tree_.block(node, block).count;
    return points;
  }
  double priority(const Front::value_type& entry) const {
    const auto [node, block] = entry;
    if (tree_.is_leaf(node)) return -1;
    const Box& box = tree_.node(tree_.child(node, block)).box;
    if (view_.pixel_bound(box, tree_.node(node).bound) <= limits_.pixel_error) return -1;
    const double levels = tree_.shape().leaf_level() - tree_.level_of(node) + 1;
    return levels / std::max(view_.distance(box), view_.near());
  }

  const LodTree& tree_;
  const View& view_;
  const SelectionLimits& limits_;
  Front front_;
};

SlowSelection::Front front_of(const Selection& selection) {
  SlowSelection::Front front;
  for (const FrontBlock& block : selection.front) front.insert({block.node, block.block});
  return front;
}

struct Case {
  LodTree tree;
  View view;
  SelectionLimits limits;
};

Case random_case(std::mt19937_64& random) {
  const RandomTreeShape shape = random_shape(random);
  LodTree tree = make_random_tree(shape, random);
  const View view(random_camera(tree.node(0).box, random), kSize, 1e-3);
  SelectionLimits limits{.points = tree.node(0).points + random() % (shape.points * 2)};
  if (random() % 3 == 0) limits.pixel_error = 1 + static_cast<double>(random() % 50);
  limits.cull_back_faces = shape.cones;
  return {std::move(tree), view, limits};
}

TEST(LodSelection, CoversEachVisibleLeafRegionOnce) {
  std::mt19937_64 random(1);
  std::uint64_t visible = 0;
  std::uint64_t invisible = 0;
  for (int round = 0; round < 100; ++round) {
    const Case c = random_case(random);
    const Selection cut = select(c.tree, c.view, c.limits);
    for (NodeIndex leaf = first_leaf(c.tree); leaf < c.tree.size(); ++leaf) {
      const bool seen = is_visible(c.tree, c.view, c.limits.cull_back_faces, leaf);
      const std::uint32_t times = times_covered(c.tree, cut, leaf);
      ASSERT_TRUE(times == 1 || (!seen && times == 0)) << "round " << round << ", leaf " << leaf;
      ++(seen ? visible : invisible);
    }
  }
  EXPECT_GT(visible, 1000u);
  EXPECT_GT(invisible, 1000u);
}

TEST(LodSelection, IsTheCutOfThePapersAlgorithm) {
  std::mt19937_64 random(2);
  for (int round = 0; round < 60; ++round) {
    const Case c = random_case(random);
    const Selection cut = select(c.tree, c.view, c.limits);
    const SlowSelection slow(c.tree, c.view, c.limits);
    ASSERT_EQ(front_of(cut), slow.front()) << "round " << round;
    ASSERT_EQ(cut.points, slow.points());
  }
}

TEST(LodSelection, SpendsTheBudgetToWithinOneNodeAndNeverMore) {
  std::mt19937_64 random(3);
  int spent = 0;
  for (int round = 0; round < 200; ++round) {
    Case c = random_case(random);
    c.limits.pixel_error = 0;
    const Selection cut = select(c.tree, c.view, c.limits);
    ASSERT_LE(cut.points, c.limits.points);
    const bool refinable = std::ranges::any_of(
        cut.front, [&](const FrontBlock& block) { return !c.tree.is_leaf(block.node); });
    if (!refinable) continue;
    ASSERT_GT(cut.points + c.tree.node_points(), c.limits.points) << "round " << round;
    ++spent;
  }
  EXPECT_GT(spent, 50);
}

TEST(LodSelection, RefinesByErrorJustAsFarAsAsked) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 60; ++round) {
    Case c = random_case(random);
    c.limits.points = SelectionLimits::kUnlimited;
    c.limits.pixel_error = 1 + static_cast<double>(random() % 80);
    const Selection cut = select(c.tree, c.view, c.limits);
    const auto bound = [&](NodeIndex node, NodeIndex region) {
      return c.view.pixel_bound(c.tree.node(region).box, c.tree.node(node).bound);
    };
    for (const FrontBlock& block : cut.front)
      ASSERT_TRUE(c.tree.is_leaf(block.node) ||
                  bound(block.node, c.tree.region_of(block.node, block.block)) <=
                      c.limits.pixel_error);
    for (const NodeIndex node : cut.nodes)
      if (node != 0) ASSERT_GT(bound(c.tree.parent(node), node), c.limits.pixel_error);
    ASSERT_LE(cut.pixel_bound, c.limits.pixel_error);  // the leaves of these trees are exact
    ASSERT_EQ(cut.inner_bound, cut.pixel_bound);
  }
}

TEST(LodSelection, AMillionPixelsOfErrorLeaveTheRoot) {
  std::mt19937_64 random(5);
  const LodTree tree = make_random_tree({}, random);
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  const Selection cut = select(tree, view, {.pixel_error = 1e6});
  EXPECT_EQ(cut.nodes, std::vector<NodeIndex>{0});
  EXPECT_EQ(cut.points, tree.node(0).points);
}

TEST(LodSelection, HoldsNoMoreNodesThanAsked) {
  std::mt19937_64 random(6);
  const LodTree tree = make_random_tree({}, random);
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  for (const std::uint64_t nodes : {1, 2, 7, 20})
    EXPECT_EQ(select(tree, view, {.nodes = nodes}).nodes.size(), nodes);
}

TEST(LodSelection, RefinesNeitherIntoWhatIsNotUsableNorIntoWhatIsHidden) {
  std::mt19937_64 random(7);
  const LodTree tree = make_random_tree({}, random);
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  const NodeIndex barred = tree.child(0, 1);
  const Selection unusable = select(tree, view, {}, [&](NodeIndex n) { return n != barred; });
  const Selection hidden = select(tree, view, {}, {}, [&](NodeIndex n) { return n == barred; });
  for (const Selection& cut : {unusable, hidden}) {
    EXPECT_FALSE(std::ranges::binary_search(cut.nodes, barred));
    EXPECT_TRUE(front_of(cut).contains({0, 1}));
    EXPECT_EQ(cut.points, tree.shape().points() - tree.shape().input_range(1, 1).count +
                              tree.block(0, 1).count);
  }
  EXPECT_EQ(hidden.hidden, 1u);
  EXPECT_EQ(unusable.hidden, 0u);
}

TEST(LodSelection, DrawsNothingOfWhatLiesBehind) {
  std::mt19937_64 random(8);
  const LodTree tree = make_random_tree({}, random);
  Camera camera = camera_around(tree.node(0).box, kSize);
  camera.target = camera.eye + (camera.eye - camera.target);
  const Selection cut = select(tree, View(camera, kSize, 1e-3), {});
  EXPECT_TRUE(cut.nodes.empty());
  EXPECT_EQ(cut.points, 0u);
  EXPECT_EQ(cut.outside, 1u);
}

TEST(LodSelection, DrawsWhatReachesIntoThePictureWithItsSplatsAlone) {
  std::mt19937_64 random(11);
  const LodTree tree = make_random_tree({}, random);
  float largest = 0;
  for (NodeIndex node = 0; node < tree.size(); ++node)
    largest = std::max(largest, tree.node(node).radius_max);
  ASSERT_GT(largest, 0.1f);
  const Box& scene = tree.node(0).box;
  const double reached = 0.9 * tree.node(0).radius_max;
  const double beyond = 1.1 * largest;
  for (const double distance : {reached, beyond}) {
    // Looks along y past the scene on its left, with rays that are as good as parallel.
    Camera camera;
    camera.fov_y_degrees = 0.01;
    const double tan_x =
        std::tan(camera.fov_y_degrees / 2 * (3.14159265358979 / 180)) * kSize.width / kSize.height;
    const double depth = scene.half.y;  // of the box's near side
    camera.eye =
        scene.center + glm::dvec3(scene.half.x + distance + depth * tan_x, -2 * scene.half.y, 0);
    camera.target = camera.eye + glm::dvec3(0, 1, 0);
    const bool drawn = select(tree, View(camera, kSize, 1e-3), {.nodes = 1}).points > 0;
    EXPECT_EQ(drawn, distance == reached) << distance;
  }
}

TEST(LodSelection, RefusesABudgetBelowTheRoot) {
  std::mt19937_64 random(9);
  const LodTree tree = make_random_tree({}, random);
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  EXPECT_THROW(select(tree, view, {.points = tree.node(0).points - 1}), formats::Error);
  EXPECT_EQ(select(tree, view, {.points = tree.node(0).points}).points, tree.node(0).points);
}

TEST(LodSelection, ADatasetOfOneNodeIsDrawnWhole) {
  std::mt19937_64 random(10);
  const LodTree tree = make_random_tree({.points = 10, .fanout = 2, .target_points = 100}, random);
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  const Selection cut = select(tree, view, {.points = 10});
  EXPECT_EQ(cut.points, 10u);
  EXPECT_EQ(cut.front.size(), 1u);
}

}  // namespace
}  // namespace cairn::viewer
