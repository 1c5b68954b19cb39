// Frames of a scene with a renderer that tells what it wants.
#include "viewer/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "tests/support/random_tree.h"

namespace cairn::viewer {
namespace {

using tests::make_random_tree;

constexpr PictureSize kSize{640, 400};

class OnePointSource : public NodeSource {
 public:
  void load(NodeIndex, NodePoints& points, const std::stop_token&) const override {
    points.position.assign(1, glm::vec3(0));
  }
};

/// Tells of each item that is asked about whether it was seen, by a rule, and draws nothing.
class ToldRenderer : public Renderer {
 public:
  using Rule = std::function<bool(const DrawItem&)>;
  ToldRenderer(std::uint32_t slots, Rule rule) : slots_(slots), rule_(std::move(rule)) {}

  std::uint32_t slots() const override { return slots_; }
  void upload(std::uint32_t, const PointColumns&) override {}
  DrawStatistics draw(const Frame& frame) override {
    DrawStatistics statistics;
    for (const DrawItem& item : frame.items) {
      statistics.points += item.count;
      if (frame.plan.occlusion_queries) statistics.seen.push_back({item.region, rule_(item)});
    }
    return statistics;
  }
  Picture picture() override { return {}; }

 private:
  std::uint32_t slots_;
  Rule rule_;
};

/// Draws until a frame has nothing left to do, at most so often; returns how often.
int frames_to_rest(Scene& scene, const View& view, int most) {
  for (int frame = 1; frame <= most; ++frame)
    if (!scene.draw(view, {}, {.occlusion = true}, true).unfinished) return frame;
  return most + 1;
}

class SceneTest : public testing::Test {
 protected:
  SceneTest() : tree_(make_tree()) {}

  static LodTree make_tree() {
    std::mt19937_64 random(1);
    return make_random_tree({}, random);
  }
  Scene make(ToldRenderer::Rule rule) {
    renderer_ = std::make_unique<ToldRenderer>(tree_.size(), std::move(rule));
    const FramePlan plan = plan_frame({}, {}, {.occlusion = true}, true);
    return {tree_, {}, source_, *renderer_, plan, {.slots = tree_.size(), .loader_threads = 2}};
  }
  View view() const { return {camera_around(tree_.node(0).box, kSize), kSize, 1e-3}; }

  LodTree tree_;
  OnePointSource source_;
  std::unique_ptr<ToldRenderer> renderer_;
};

TEST_F(SceneTest, RegionsThatOthersHideAreNotRefined) {
  const NodeIndex hidden = tree_.child(0, 1);
  Scene scene = make([&](const DrawItem& item) {
    NodeIndex region = item.region;
    while (region > hidden) region = tree_.parent(region);
    return region != hidden;
  });
  frames_to_rest(scene, view(), 100'000);
  // What was hidden is known one frame, and one level up, at a time.
  FrameStatistics frame;
  for (std::uint32_t i = 0; i < 10; ++i) frame = scene.draw(view(), {}, {.occlusion = true}, true);
  EXPECT_EQ(frame.hidden, 1u);
  EXPECT_FALSE(std::ranges::binary_search(scene.drawn().nodes, hidden));
  EXPECT_FALSE(frame.unfinished);
}

TEST_F(SceneTest, ComesToRestWhereOnlyTheLargeSplatsOfCoarseBlocksAreSeen) {
  const auto leaf_level = tree_.shape().leaf_level();
  Scene scene = make(
      [&](const DrawItem& item) { return item.probe || tree_.level_of(item.region) < leaf_level; });
  ASSERT_LE(frames_to_rest(scene, view(), 100'000), 100'000);
  // Hidden regions are found in a frame, revealed in the next: never again in the same view.
  int unfinished = 0;
  for (int i = 0; i < 200; ++i)
    unfinished += scene.draw(view(), {}, {.occlusion = true}, true).unfinished ? 1 : 0;
  EXPECT_LE(unfinished, 2 * static_cast<int>(leaf_level));
}

}  // namespace
}  // namespace cairn::viewer
