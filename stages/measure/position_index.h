// Exact search for the nearest of many positions: FLANN's kd-tree over grid steps.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "formats/dataset/grid.h"

namespace cairn::stages {

/// What a search fills: it is offered positions as far as they are of use to it.
class PositionSink {
 public:
  virtual ~PositionSink() = default;
  /// Positions whose squared distance is above this are of no use; may shrink while a search goes on.
  virtual double reach() const = 0;
  /// Position number `index` of those that were indexed; its squared distance is in world units, as
  /// formats::squared_distance rounds it, and not above reach().
  virtual void offer(double squared_distance, std::size_t index) = 0;
};

class PositionIndex {
 public:
  /// Indexes `positions`, at least one. `step` is the grid's.
  PositionIndex(std::span<const formats::GridPoint> positions, const std::array<double, 3>& step);
  ~PositionIndex();
  PositionIndex(const PositionIndex&) = delete;
  PositionIndex& operator=(const PositionIndex&) = delete;

  /// Offers all positions that are within the sink's reach when it comes to them, in an order that follows from the
  /// positions and the query alone. Any number of threads at a time.
  void search(const formats::GridPoint& query, PositionSink& sink) const;

  /// Memory of an index, by FLANN's structures rounded up.
  static constexpr std::uint64_t kBytesPerPosition = 96;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace cairn::stages
