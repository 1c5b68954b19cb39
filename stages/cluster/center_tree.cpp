#include "stages/cluster/center_tree.h"

#include <algorithm>

#include "formats/error.h"

namespace cairn::stages {

CenterTree::CenterTree(std::span<const Location> centers) {
  CAIRN_CHECK(!centers.empty());
  Bucket none;
  Boxes nothing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    none.at[axis].fill(kInfinite);
    nothing.low[axis].fill(kInfinite);
    nothing.high[axis].fill(-kInfinite);
  }
  const auto parents_of = [](std::size_t count) { return (count + kWidth - 1) / kWidth; };
  buckets_.resize(parents_of(centers.size()), none);
  for (std::size_t i = 0; i < centers.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      buckets_[i / kWidth].at[axis][i % kWidth] = centers[i][axis];
  if (buckets_.size() > 1) {
    auto& lowest = boxes_.emplace_back(parents_of(buckets_.size()), nothing);
    for (std::size_t i = 0; i < centers.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t bucket = i / kWidth;
        double& low = lowest[bucket / kWidth].low[axis][bucket % kWidth];
        double& high = lowest[bucket / kWidth].high[axis][bucket % kWidth];
        low = std::min(low, centers[i][axis]);
        high = std::max(high, centers[i][axis]);
      }
  }
  while (!boxes_.empty() && boxes_.back().size() > 1) {
    const std::vector<Boxes>& below = boxes_.back();
    std::vector<Boxes> level(parents_of(below.size()), nothing);
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        level[i / kWidth].low[axis][i % kWidth] = *std::ranges::min_element(below[i].low[axis]);
        level[i / kWidth].high[axis][i % kWidth] = *std::ranges::max_element(below[i].high[axis]);
      }
    boxes_.push_back(std::move(level));
  }
  top_ = static_cast<std::uint32_t>(boxes_.size());
}

}  // namespace cairn::stages
