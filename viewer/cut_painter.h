// Draws cuts of a dataset settled, all their nodes at hand, for measuring what pictures lose and how long they take.
#pragma once

#include <cstdint>
#include <stop_token>

#include "viewer/cpu/cpu_renderer.h"
#include "viewer/dataset_view.h"
#include "viewer/picture_difference.h"

namespace cairn::viewer {

/// A cut as it was drawn. Its times are the least of CutPainter::kFrames frames.
struct DrawnCut {
  CoveredPicture shown;
  FrameStatistics frame;
};

class CutPainter {
 public:
  static constexpr int kFrames = 3;

  /// Holds `nodes` nodes at a time, so that any cut of no more is drawn whole. `plan`: of all frames, or one with more
  /// columns. `dataset` and `tree` must outlive the painter. Throws Error (kUsage) where the renderer cannot number the
  /// points of so many, 2^31, and (kSystem) where there is no room for them.
  CutPainter(const formats::DatasetReader& dataset, const LodTree& tree, const FramePlan& plan,
             std::uint64_t nodes, unsigned loader_threads);

  /// Memory that so many nodes take, those under way too.
  static std::uint64_t node_bytes(const LodTree& tree, const FramePlan& plan, std::uint64_t nodes,
                                  unsigned loader_threads);

  /// Uses the threads of the TBB arena that it is called in. Throws Error (kInput) for a damaged node. After a stop
  /// request what has been read is drawn.
  DrawnCut draw(const View& view, const SelectionLimits& limits, const Wishes& wishes,
                const std::stop_token& stop = {});

 private:
  CpuRenderer* renderer_ = nullptr;  ///< the view's
  DatasetView view_;
};

}  // namespace cairn::viewer
