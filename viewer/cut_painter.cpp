#include "viewer/cut_painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

CacheOptions cache_for(const LodTree& tree, const FramePlan& plan, std::uint64_t nodes,
                       unsigned loader_threads) {
  const CacheOptions cache{.bytes = CutPainter::node_bytes(tree, plan, nodes, loader_threads),
                           .loader_threads = loader_threads};
  const std::uint64_t slots = slots_of(tree, plan, cache);
  if (slots < nodes)
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "a cut is too large for the renderer",
         .found = fmt::format("{} nodes", nodes),
         .expected = fmt::format("at most {} of {} points each", slots, tree.node_points())});
  return cache;
}

}  // namespace

CutPainter::CutPainter(const formats::DatasetReader& dataset, const LodTree& tree,
                       const FramePlan& plan, std::uint64_t nodes, unsigned loader_threads)
    : view_(dataset, tree, plan, cache_for(tree, plan, nodes, loader_threads),
            [this](const RendererSize& size) {
              auto renderer = std::make_unique<CpuRenderer>(size);
              renderer_ = renderer.get();
              return renderer;
            }) {}

std::uint64_t CutPainter::node_bytes(const LodTree& tree, const FramePlan& plan,
                                     std::uint64_t nodes, unsigned loader_threads) {
  return (nodes + Front::nodes_under_way(loader_threads)) * tree.node_points() *
         columns_of(plan).point_bytes();
}

DrawnCut CutPainter::draw(const View& view, const SelectionLimits& limits, const Wishes& wishes,
                          const std::stop_token& stop) {
  DrawnCut drawn;
  for (int i = 0; i < kFrames; ++i) {
    FrameStatistics frame = view_.scene().draw_settled(view, limits, wishes, stop);
    if (!frame.damage.empty())
      throw formats::Error(formats::ErrorKind::kInput, {.what = frame.damage.front()});
    if (i > 0) {
      frame.select_ms = std::min(frame.select_ms, drawn.frame.select_ms);
      frame.draw_ms = std::min(frame.draw_ms, drawn.frame.draw_ms);
    }
    drawn.frame = std::move(frame);
  }
  drawn.shown = {renderer_->picture(), renderer_->covered()};
  return drawn;
}

}  // namespace cairn::viewer
