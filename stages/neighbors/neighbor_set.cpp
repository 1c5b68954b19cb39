#include "stages/neighbors/neighbor_set.h"

#include <algorithm>

namespace cairn::stages {

bool NeighborSet::holds(const Neighbor& neighbor) const {
  return std::ranges::find(sorted(), neighbor) != sorted().end();
}

void NeighborSet::add(const Neighbor& neighbor) {
  const auto is_before = [&](const Neighbor& other) {
    return neighbor.squared_distance != other.squared_distance
               ? neighbor.squared_distance < other.squared_distance
               : neighbor.position < other.position;
  };
  if (full() && !is_before(slots_.back())) return;
  std::size_t at = full() ? count_ - 1 : count_++;
  for (; at > 0 && is_before(slots_[at - 1]); --at) slots_[at] = slots_[at - 1];
  slots_[at] = neighbor;
}

}  // namespace cairn::stages
