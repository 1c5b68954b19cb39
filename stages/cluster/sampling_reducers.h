// Reducers that keep some of a node's points as they are, for comparison and for quick previews: the
// points along the curve are cut into as many equal runs as representatives are wanted, and one point
// of each run stands for all of it.
#pragma once

#include "stages/cluster/reducer.h"

namespace cairn::stages {

class SamplingReducer final : public Reducer {
 public:
  /// Which point of a run is kept.
  enum class Pick {
    kFirst,   ///< the first along the curve
    kRandom,  ///< any, by a hash of node and run, so that it is the same on every run of the program
  };

  explicit SamplingReducer(Pick pick) : pick_(pick) {}

  std::string_view name() const override { return pick_ == Pick::kFirst ? "first" : "random"; }
  bool exact_count() const override { return true; }
  Reduction reduce(const NodeView& node, std::uint64_t quota) const override;

 private:
  Pick pick_;
};

}  // namespace cairn::stages
