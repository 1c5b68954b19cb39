// The reducer of the paper: clusters of points that are close and face the same way.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, 2010, section III.B, procedure Representatives (Figure
// 4). Where it departs: the queue of lists is ordered by length, and since merging in one list does not
// change another, the order of the pops need not be played out: level_lengths() tells how long each list
// ends. Coincident points collapse first, and where every list is down to one cluster the grid is
// coarsened, so that exactly the quota remains.
#pragma once

#include "stages/cluster/reducer.h"

namespace cairn::stages {

class ClusterReducer final : public Reducer {
 public:
  explicit ClusterReducer(const ClusterOptions& options) : options_(options) {}

  std::string_view name() const override { return "cluster"; }
  bool exact_count() const override { return true; }
  Reduction reduce(const NodeView& node, std::uint64_t quota) const override;

 private:
  ClusterOptions options_;
};

}  // namespace cairn::stages
