// The points of nodes in memory: columns of equal slots, allocated once. Pages that no node was put into take no memory.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "viewer/cpu/point_batch.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

class SlotPool {
 public:
  /// Throws Error (kSystem) if there is no room for so many points.
  explicit SlotPool(const RendererSize& size);

  const RendererSize& size() const { return size_; }
  /// Requires slot < slots, at most slot_points points and the pool's columns, of one length.
  void put(std::uint32_t slot, const PointColumns& points);
  /// Of the points that were put last into a slot.
  std::uint32_t count(std::uint32_t slot) const { return counts_[slot]; }
  /// Requires first <= count(slot).
  SlotColumns columns(std::uint32_t slot, std::uint32_t first) const;

 private:
  RendererSize size_;
  std::vector<std::uint32_t> counts_;
  std::unique_ptr<float[]> x_, y_, z_, radius_;
  std::unique_ptr<std::uint32_t[]> color_, normal_;
};

}  // namespace cairn::viewer
