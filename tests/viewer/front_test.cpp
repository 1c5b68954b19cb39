// The front across frames under random trees, cameras, delays, cache sizes and damage.
#include "viewer/front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <glm/geometric.hpp>
#include <map>
#include <semaphore>
#include <thread>

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

/// Nodes of one point at (number, 0, 0), after a delay that depends on the node; some are damaged.
class DelayedSource : public NodeSource {
 public:
  DelayedSource(std::uint64_t seed, std::uint32_t damaged_of_100)
      : seed_(seed), damaged_of_100_(damaged_of_100) {}

  void load(NodeIndex node, NodePoints& points, const std::stop_token&) const override {
    std::mt19937_64 random(seed_ * 1'000'003 + node);
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 800));
    if (is_damaged(node)) formats::throw_input({.what = "damaged", .found = std::to_string(node)});
    points.position.assign(1, glm::vec3(static_cast<float>(node), 0, 0));
  }
  bool is_damaged(NodeIndex node) const {
    std::mt19937_64 random(seed_ * 7'000'003 + node);
    return node != 0 && random() % 100 < damaged_of_100_;
  }

 private:
  std::uint64_t seed_;
  std::uint32_t damaged_of_100_;
};

/// A front with a renderer that remembers what lies in which slot.
class Watched {
 public:
  Watched(const LodTree& tree, const NodeSource& source, const FrontOptions& options)
      : tree_(tree),
        options_(options),
        front_(tree, source, options, [this](auto slot, const auto& points) {
          ASSERT_LT(slot, options_.slots);
          in_slot_[slot] = static_cast<NodeIndex>(points.position[0].x);
          ++uploads_;
        }) {}

  FrontFrame advance(const View& view, const SelectionLimits& limits, const NodeTest& hidden = {}) {
    uploads_ = 0;
    FrontFrame frame = front_.advance(view, limits, hidden);
    check(view, limits, frame);
    return frame;
  }
  void wait() { front_.wait(); }
  std::uint64_t damaged() const { return front_.damaged(); }

 private:
  void check(const View& view, const SelectionLimits& limits, const FrontFrame& frame) {
    ASSERT_LE(uploads_, options_.uploads);
    ASSERT_LE(frame.drawn.points, limits.points);
    ASSERT_LE(frame.selected.nodes.size(), options_.slots);
    for (const FrontBlock& block : frame.drawn.front)
      ASSERT_EQ(in_slot_[front_.slot_of(block.node)], block.node);
    const auto leaf_level = tree_.shape().leaf_level();
    for (auto leaf = static_cast<NodeIndex>(formats::value_of(tree_.shape().id(leaf_level, 0)));
         leaf < tree_.size(); ++leaf) {
      const std::uint32_t times = times_covered(tree_, frame.drawn, leaf);
      const bool seen = is_visible(tree_, view, limits.cull_back_faces, leaf);
      ASSERT_TRUE(times == 1 || (!seen && times == 0)) << "leaf " << leaf << " " << times;
    }
  }

  const LodTree& tree_;
  FrontOptions options_;
  std::map<std::uint32_t, NodeIndex> in_slot_;
  std::uint32_t uploads_ = 0;
  Front front_;
};

bool same_front(const Selection& a, const Selection& b) {
  const auto equal = [](const FrontBlock& x, const FrontBlock& y) {
    return x.node == y.node && x.block == y.block;
  };
  return a.points == b.points && std::ranges::equal(a.front, b.front, equal);
}

/// Advances until nothing is missing.
FrontFrame rest(Watched& front, const View& view, const SelectionLimits& limits,
                const NodeTest& hidden = {}) {
  while (true) {
    FrontFrame frame = front.advance(view, limits, hidden);
    if (frame.missing == 0) return frame;
    front.wait();
  }
}

struct World {
  LodTree tree;
  SelectionLimits limits;
  FrontOptions options;
};

World random_world(std::mt19937_64& random) {
  const RandomTreeShape shape{.points = 2000 + random() % 20'000,
                              .fanout = static_cast<std::uint32_t>(2 + random() % 5),
                              .target_points = 100 + random() % 200,
                              .cones = random() % 2 == 0};
  LodTree tree = make_random_tree(shape, random);
  const SelectionLimits limits{.points = tree.node(0).points + random() % shape.points,
                               .pixel_error = random() % 2 == 0 ? 0.0 : 5.0,
                               .cull_back_faces = shape.cones};
  const FrontOptions options{.slots = static_cast<std::uint32_t>(1 + random() % 60),
                             .cached_nodes = 1 + random() % 20,
                             .loader_threads = static_cast<unsigned>(1 + random() % 3),
                             .prefetch = random() % 2 == 0,
                             .uploads = static_cast<std::uint32_t>(1 + random() % 8)};
  return {std::move(tree), limits, options};
}

TEST(Front, CoversEachVisibleRegionOnceInEveryFrameAndRestsOnTheSelectedCut) {
  std::mt19937_64 random(1);
  std::uint64_t standing_in = 0;
  for (int round = 0; round < 25; ++round) {
    const World world = random_world(random);
    const DelayedSource source(random(), round % 3 == 0 ? 10 : 0);
    Watched front(world.tree, source, world.options);
    std::uint64_t forced = 0;
    std::uint64_t seed = 0;  // what others hide changes from frame to frame
    const NodeTest hidden =
        round % 4 == 0 ? NodeTest{} : [&](NodeIndex node) { return (node * 7919 + seed) % 6 == 0; };
    for (int stop = 0; stop < 4 && !testing::Test::HasFatalFailure(); ++stop) {
      const Box& scene = world.tree.node(0).box;
      Camera camera = random_camera(scene, random);
      for (int step = 0; step < 12; ++step) {  // a moving camera
        camera.eye += 0.02 * (camera.target - camera.eye);
        camera.target.x += 0.05 * scene.half.x;
        seed = random();
        const FrontFrame frame = front.advance(View(camera, kSize, 1e-3), world.limits, hidden);
        forced += frame.forced_loads;
        standing_in += same_front(frame.drawn, frame.selected) ? 0 : 1;
        if (step % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(500));
      }
      const FrontFrame still = rest(front, View(camera, kSize, 1e-3), world.limits, hidden);
      ASSERT_TRUE(same_front(still.drawn, still.selected));
      for (const NodeIndex node : still.drawn.nodes) ASSERT_FALSE(source.is_damaged(node));
    }
    ASSERT_EQ(forced, 1u) << "only the root, where there was nothing before, is waited for";
  }
  EXPECT_GT(standing_in, 100u);
}

TEST(Front, FramesAreOnlyNeededWhereTheLastOneOrTheLoaderTellsThatThereIsMore) {
  std::mt19937_64 random(8);
  for (int round = 0; round < 25; ++round) {
    World world = random_world(random);
    std::counting_semaphore<> loaded(0);
    world.options.loaded = [&] { loaded.release(); };
    const DelayedSource source(random(), round % 3 == 0 ? 10 : 0);
    Watched front(world.tree, source, world.options);
    const View view(random_camera(world.tree.node(0).box, random), kSize, 1e-3);
    FrontFrame frame = front.advance(view, world.limits);
    for (std::uint32_t frames = 0; frame.unfinished; ++frames) {
      ASSERT_LT(frames, 10 * world.tree.size()) << "it does not come to rest";
      if (frame.waiting) {
        ASSERT_TRUE(loaded.try_acquire_for(std::chrono::seconds(30))) << "nobody tells";
      }
      frame = front.advance(view, world.limits);
    }
    EXPECT_EQ(frame.missing, 0u);
    EXPECT_TRUE(same_front(frame.drawn, frame.selected));
  }
}

TEST(Front, ADamagedNodeIsToldOnceAndItsAncestorDrawnForGood) {
  std::mt19937_64 random(2);
  const LodTree tree = make_random_tree({}, random);
  const DelayedSource source(5, 30);
  Watched front(tree, source, {.slots = tree.size(), .loader_threads = 2});
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  std::map<std::string, int> told;
  for (int round = 0; round < 5; ++round) {
    FrontFrame frame = front.advance(view, {});
    for (int settled = 0; settled < 3;) {
      for (const std::string& line : frame.damage) ++told[line];
      settled = frame.missing == 0 ? settled + 1 : 0;
      front.wait();
      frame = front.advance(view, {});
    }
  }
  // Damaged nodes whose ancestors are whole: below others nothing is asked for.
  std::size_t reachable = 0;
  for (NodeIndex node = 1; node < tree.size(); ++node) {
    bool whole_above = true;
    for (NodeIndex up = tree.parent(node); up != 0; up = tree.parent(up))
      whole_above = whole_above && !source.is_damaged(up);
    if (whole_above && source.is_damaged(node)) ++reachable;
  }
  EXPECT_GT(reachable, 3u);
  EXPECT_EQ(told.size(), reachable);
  for (const auto& [line, times] : told) EXPECT_EQ(times, 1) << line;
}

TEST(Front, ADamagedRootIsAnError) {
  std::mt19937_64 random(3);
  const LodTree tree = make_random_tree({}, random);
  class NoSource : public NodeSource {
    void load(NodeIndex, NodePoints&, const std::stop_token&) const override {
      formats::throw_input({.what = "damaged"});
    }
  } const source;
  Watched front(tree, source, {});
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  EXPECT_THROW(front.advance(view, {}), formats::Error);
}

TEST(Front, WhatWasSeenBeforeIsAHit) {
  std::mt19937_64 random(4);
  const LodTree tree = make_random_tree({}, random);
  const DelayedSource source(6, 0);
  Watched front(tree, source, {.slots = tree.size(), .loader_threads = 2});
  const View view(camera_around(tree.node(0).box, kSize), kSize, 1e-3);
  Camera away = view.camera();
  away.target = away.eye + (away.eye - away.target);
  const FrontFrame first = rest(front, view, {});
  const FrontFrame nothing = front.advance(View(away, kSize, 1e-3), {});
  EXPECT_EQ(nothing.drawn.points, 0u);
  const FrontFrame again = front.advance(view, {});
  EXPECT_EQ(again.hits, first.selected.nodes.size());
  EXPECT_EQ(again.loads, 0u);
  EXPECT_EQ(again.missing, 0u);
}

TEST(Front, PrefetchHasWhatATurnBringsIntoThePicture) {
  std::mt19937_64 random(5);
  const LodTree tree =
      make_random_tree({.points = 60'000, .fanout = 5, .target_points = 100}, random);
  const DelayedSource source(7, 0);
  Camera camera = camera_around(tree.node(0).box, kSize);
  camera.fov_y_degrees = 12;
  const View view(camera, kSize, 1e-3);
  Camera turned = camera;
  turned.target += 0.04 * glm::length(camera.target - camera.eye) * view.right();
  std::uint64_t missing[2] = {};
  for (const bool prefetch : {false, true}) {
    Watched front(tree, source,
                  {.slots = tree.size(),
                   .cached_nodes = tree.size(),
                   .loader_threads = 2,
                   .prefetch = prefetch});
    rest(front, view, {});
    for (int frame = 0; frame < 200; ++frame) {
      front.wait();
      front.advance(view, {});
    }
    missing[prefetch ? 1 : 0] = front.advance(View(turned, kSize, 1e-3), {}).missing;
  }
  EXPECT_GT(missing[0], 0u);
  EXPECT_EQ(missing[1], 0u);
}

/// A network that brings the root, and all else only while it is up.
class FlakyNetwork : public NodeSource {
 public:
  void load(NodeIndex node, NodePoints& points, const std::stop_token&) const override {
    ++asked;
    if (node != 0 && !up)
      throw formats::Error(formats::ErrorKind::kSystem,
                           {.what = "no answer", .found = std::to_string(node)});
    points.position.assign(1, glm::vec3(static_cast<float>(node), 0, 0));
  }
  bool is_remote() const override { return true; }

  mutable std::atomic<int> asked = 0;
  std::atomic<bool> up = false;
};

TEST(FrontOverANetwork, WhatDoesNotComeIsDrawnByAncestorsToldOnceAndAskedForAgain) {
  std::mt19937_64 random(5);
  const LodTree tree = make_random_tree(
      {.points = 10'000, .fanout = 4, .target_points = 150, .cones = false}, random);
  FlakyNetwork network;
  Watched front(tree, network, {.slots = 1000, .first_pause = std::chrono::seconds(2)});
  const View view(random_camera(tree.node(0).box, random), kSize, 1e-3);
  const SelectionLimits limits{.points = 3000};
  std::size_t told = 0;
  FrontFrame frame;
  do {
    frame = front.advance(view, limits);
    told += frame.damage.size();
    front.wait();
  } while (frame.missing > 0 || frame.unreachable == 0);
  front.advance(view, limits);
  front.wait();  // for what was still under way
  EXPECT_EQ(told, 1u);
  EXPECT_EQ(front.damaged(), 0u);
  const int asked = network.asked;
  front.advance(view, limits);
  EXPECT_EQ(network.asked, asked) << "not before the pause is over";
  network.up = true;
  const auto begin = std::chrono::steady_clock::now();
  while (frame.missing > 0 || frame.unreachable > 0) {
    frame = front.advance(view, limits);
    front.wait();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
  }
  EXPECT_GT(frame.drawn.nodes.size(), 1u);
  EXPECT_TRUE(frame.damage.empty());
}

}  // namespace
}  // namespace cairn::viewer
