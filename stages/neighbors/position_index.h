// Exact search for the nearest of many positions: FLANN's kd-tree over grid steps.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "formats/dataset/grid.h"
#include "stages/neighbors/neighbor_set.h"

namespace cairn::stages {

class PositionIndex {
 public:
  /// Indexes `positions`, which must outlive the index: at least one, all distinct. `step` is the
  /// grid's.
  PositionIndex(std::span<const formats::GridPoint> positions, const std::array<double, 3>& step);
  ~PositionIndex();
  PositionIndex(const PositionIndex&) = delete;
  PositionIndex& operator=(const PositionIndex&) = delete;

  /// Adds the positions nearest to `query` to a set that holds none of the index.
  void search(const formats::GridPoint& query, NeighborSet& nearest) const;
  /// The same where the set may already hold some of the index's positions.
  void search_others(const formats::GridPoint& query, NeighborSet& nearest) const;

  /// Memory of an index, by FLANN's structures rounded up.
  static constexpr std::uint64_t kBytesPerPosition = 96;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace cairn::stages
