// Draws on the processor: for machines without a GPU, for tests, and for measuring pictures. A frame is the same for any
// number of threads and any order of its items. It uses the threads of the TBB arena that it is called in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "viewer/cpu/slot_pool.h"
#include "viewer/cpu/splat_pass.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

class CpuRenderer final : public Renderer {
 public:
  /// Throws Error (kSystem) if there is no room for so many points.
  explicit CpuRenderer(const RendererSize& size) : pool_(size) {}

  std::uint32_t slots() const override { return pool_.size().slots; }
  void upload(std::uint32_t slot, const PointColumns& points) override { pool_.put(slot, points); }
  /// Requires a plan whose columns the renderer has, and items within what was put into their slots. There are no
  /// occlusion queries: probes are drawn as others are. Deferred blending draws the ordinary blend.
  DrawStatistics draw(const Frame& frame) override;
  Picture picture() override { return picture_; }
  /// Which pixels of the last frame show a point, not the background: 1 or 0 a pixel, rows from the top.
  std::vector<std::uint8_t> covered() const;

  /// Of the buffers of pixels that the frames so far made necessary.
  std::size_t buffer_bytes() const;

 private:
  /// Points that one task draws.
  struct Chunk {
    std::size_t item;
    std::uint32_t first, count;
  };

  void make_buffers(const Frame& frame);
  void make_chunks(const std::vector<DrawItem>& items);
  void draw_splats(const Frame& frame, BatchRules rules);
  /// Calls draw(batch, radii) for all points, in parallel.
  template <typename Draw>
  void for_each_batch(const Frame& frame, const BatchRules& rules, const Draw& draw) const;

  SlotPool pool_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint64_t> words_;  ///< one a pixel, nearest_buffer.h
  std::vector<SplatSums> sums_;       ///< one a pixel, from the first frame with splats on
  Picture picture_;
};

}  // namespace cairn::viewer
