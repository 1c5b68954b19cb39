// Reducers that keep some of a node's points as they are, each standing for those that it is nearest to: for comparison, and
// for quick previews.
#pragma once

#include "stages/cluster/reducer.h"

namespace cairn::stages {

class SamplingReducer final : public Reducer {
 public:
  /// Which points are kept.
  enum class Pick {
    kFirst,  ///< of equal runs along the curve the first points
    kRandom,  ///< any, all with the same chance, by a hash of node and point: so they are the same on every run
  };

  explicit SamplingReducer(Pick pick) : pick_(pick) {}

  std::string_view name() const override { return pick_ == Pick::kFirst ? "first" : "random"; }
  bool exact_count() const override { return true; }
  Reduction reduce(const NodeView& node, std::uint64_t quota) const override;

 private:
  Pick pick_;
};

}  // namespace cairn::stages
