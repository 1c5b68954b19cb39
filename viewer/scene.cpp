#include "viewer/scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <utility>

#include "formats/error.h"
#include "viewer/depth_layers.h"
#include "viewer/point_colors.h"

namespace cairn::viewer {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Colors for errors between a quarter of a pixel and 64 pixels, each doubling the same step.
std::uint32_t error_color(double pixels) {
  return ramp_color((std::log2(std::clamp(pixels, 0.25, 64.0)) + 2) / 8);
}

/// Whether `next` goes on where `item` ends and is drawn alike.
bool continues(const DrawItem& item, const DrawItem& next) {
  return item.slot == next.slot && item.first + item.count == next.first && item.tint == next.tint;
}

}  // namespace

double near_plane(const Box& scene) {
  return 1e-6 * std::max(glm::length(scene.half), 1e-9 * (1 + glm::length(scene.center)));
}

Scene::Scene(const LodTree& tree, const SceneFacts& facts, const NodeSource& source,
             Renderer& renderer, const FramePlan& plan, const FrontOptions& options)
    : tree_(tree),
      facts_(facts),
      renderer_(renderer),
      columns_(columns_of(plan)),
      front_(tree, source, options, [&renderer](std::uint32_t slot, const PointColumns& points) {
        renderer.upload(slot, points);
      }) {}

FrameStatistics Scene::draw(const View& view, const SelectionLimits& limits, const Wishes& wishes,
                            bool queries) {
  FrontFrame front = front_.advance(
      view, limits,
      queries ? [this](NodeIndex node) { return hidden_.contains(node); } : NodeTest{});
  drawn_ = std::move(front.drawn);
  note_view(view);
  ViewFacts seen{.splat_pixels = drawn_.splat_pixels};
  if (queries && !wishes.occlusion)
    seen.depth_layers = depth_layers_ = std::max(depth_layers_, depth_layers(tree_, view, drawn_));
  FrameStatistics frame;
  frame.plan = plan_frame(facts_, seen, wishes, queries);
  CAIRN_CHECK(columns_.holds(columns_of(frame.plan)));
  const Frame items = make_frame(view, frame.plan);
  frame.select_ms = front.select_ms;

  const Clock::time_point begin = Clock::now();
  const DrawStatistics drawn = renderer_.draw(items);
  frame.draw_ms = milliseconds_since(begin);
  const bool revealed =
      frame.plan.occlusion_queries ? note_seen(view, drawn.seen) : forget_hidden();

  frame.points = drawn.points;
  frame.unseen_points = drawn.unseen_points;
  frame.nodes = drawn_.nodes.size();
  frame.nodes_on_level.resize(tree_.shape().leaf_level() + 1);
  for (const NodeIndex node : drawn_.nodes) ++frame.nodes_on_level[tree_.level_of(node)];
  frame.loads = front.loads;
  frame.forced_loads = front.forced_loads;
  frame.hits = front.hits;
  frame.missing = front.missing;
  frame.unfinished = front.unfinished || revealed;
  frame.waiting = front.waiting && !revealed;
  frame.damaged = front_.damaged();
  frame.unreachable = front.unreachable;
  frame.outside = drawn_.outside;
  frame.facing_away = drawn_.facing_away;
  frame.hidden = drawn_.hidden;
  frame.finest = drawn_.finest;
  frame.pixel_bound = drawn_.pixel_bound;
  frame.inner_bound = drawn_.inner_bound;
  frame.damage = std::move(front.damage);
  return frame;
}

FrameStatistics Scene::draw_settled(const View& view, const SelectionLimits& limits,
                                    const Wishes& wishes, const std::stop_token& stop) {
  FrontFrame loading = front_.advance(view, limits);
  std::vector<std::string> damage = std::move(loading.damage);
  std::uint64_t loads = loading.loads;
  std::uint64_t forced_loads = loading.forced_loads;
  std::uint64_t hits = loading.hits;
  while (loading.missing > 0 && !stop.stop_requested()) {
    front_.wait(stop);
    loading = front_.advance(view, limits);
    std::ranges::move(loading.damage, std::back_inserter(damage));
    loads += loading.loads;
    hits += loading.hits;
  }
  FrameStatistics frame = draw(view, limits, wishes, /*queries=*/false);
  frame.loads += loads;
  frame.forced_loads += forced_loads;
  frame.hits += hits;
  frame.damage.insert(frame.damage.begin(), damage.begin(), damage.end());
  return frame;
}

Frame Scene::make_frame(const View& view, const FramePlan& plan) const {
  Frame frame{.view = view, .plan = plan, .items = {}};
  for (const FrontBlock& block : drawn_.front) {
    const DrawItem item = make_item(view, plan, block);
    // Queries are asked a region, all else is drawn in ranges as long as possible.
    if (!plan.occlusion_queries && !frame.items.empty() && continues(frame.items.back(), item))
      frame.items.back().count += item.count;
    else
      frame.items.push_back(item);
  }
  const auto squared_distance = [&](const DrawItem& item) {
    const glm::vec3& at = plan.occlusion_queries ? item.box_center : item.offset;
    return glm::dot(at, at);
  };
  std::ranges::stable_sort(frame.items, {}, squared_distance);
  return frame;
}

DrawItem Scene::make_item(const View& view, const FramePlan& plan, const FrontBlock& block) const {
  const formats::IndexRange range = tree_.block(block.node, block.block);
  const NodeIndex region = tree_.region_of(block.node, block.block);
  const Box& box = tree_.node(region).box;
  DrawItem item{.slot = front_.slot_of(block.node),
                .first = static_cast<std::uint32_t>(range.first),
                .count = static_cast<std::uint32_t>(range.count),
                .offset = glm::vec3(tree_.node(block.node).box.center - view.eye()),
                .tint = tint_of(view, plan, block.node, box),
                .region = region,
                .probe = block.hidden};
  if (plan.occlusion_queries) {
    item.box_center = glm::vec3(box.center - view.eye());
    item.box_half = glm::vec3(box.half);
  }
  return item;
}

std::uint32_t Scene::tint_of(const View& view, const FramePlan& plan, NodeIndex node,
                             const Box& region) const {
  switch (plan.color) {
    case ColorSource::kPlain:
      return pack_color(205, 203, 198);
    case ColorSource::kLevel:
      return palette_color(tree_.level_of(node));
    case ColorSource::kError:
      return error_color(view.pixel_bound(region, tree_.node(node).bound));
    default:
      return 0;
  }
}

bool Scene::forget_hidden() {
  const bool some = !hidden_.empty();
  hidden_.clear();
  return some;
}

void Scene::note_view(const View& view) {
  if (view_ && view_->camera() == view.camera() && view_->size() == view.size()) return;
  view_ = view;
  revealed_.clear();
  depth_layers_ = 0;
}

bool Scene::note_seen(const View& view, const std::vector<RegionSeen>& seen) {
  bool revealed = false;
  const auto hide = [&](NodeIndex region) {
    if (!revealed_.contains(region)) hidden_.insert(region);
  };
  for (const auto& [region, is_seen] : seen) {
    // A region that reaches out of the picture may have no sample because its few points lie outside.
    if (!is_seen && view.sees_all_of(tree_.node(region).box)) {
      hide(region);
    } else if (hidden_.erase(region) > 0) {
      revealed_.insert(region);
      revealed = true;
    }
  }
  // A node all of whose visible regions are hidden is hidden itself: it need not be refined. Children come first.
  for (std::size_t end = drawn_.front.size(), i = drawn_.nodes.size(); i-- > 1;) {
    const NodeIndex node = drawn_.nodes[i];
    bool all_hidden = true;
    bool any = false;
    for (; end > 0 && drawn_.front[end - 1].node == node; --end) {
      any = true;
      all_hidden =
          all_hidden && hidden_.contains(tree_.region_of(node, drawn_.front[end - 1].block));
    }
    if (!tree_.is_leaf(node))
      for (std::uint32_t block = 0; block < tree_.fanout(); ++block) {
        const NodeIndex child = tree_.child(node, block);
        if (!std::ranges::binary_search(drawn_.nodes, child)) continue;
        any = true;
        all_hidden = all_hidden && hidden_.contains(child);
      }
    if (any && all_hidden && view.sees_all_of(tree_.node(node).box)) hide(node);
  }
  return revealed;
}

}  // namespace cairn::viewer
