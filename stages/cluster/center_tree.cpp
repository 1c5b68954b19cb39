#include "stages/cluster/center_tree.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "formats/error.h"

namespace cairn::stages {

/// kNoAxis where the members share one place.
std::uint32_t CenterTree::longest_axis(std::span<const Location> centers,
                                       std::span<const std::uint32_t> members) {
  Location low = centers[members[0]], high = low;
  for (const std::uint32_t i : members)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], centers[i][axis]);
      high[axis] = std::max(high[axis], centers[i][axis]);
    }
  std::uint32_t longest = 0;
  for (std::uint32_t axis = 1; axis < 3; ++axis)
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  return high[longest] == low[longest] ? kNoAxis : longest;
}

CenterTree::CenterTree(std::span<const Location> centers) : order_(centers.size()) {
  CAIRN_CHECK(!centers.empty());
  std::iota(order_.begin(), order_.end(), 0U);
  planes_.resize(2 * std::bit_ceil(centers.size() / kBucket + 1));
  build({0, 0, static_cast<std::uint32_t>(centers.size())}, centers);
  sorted_.reserve(centers.size());
  for (const std::uint32_t i : order_) sorted_.push_back(centers[i]);
}

void CenterTree::build(const Part& part, std::span<const Location> centers) {
  const auto members = std::span(order_).subspan(part.first, part.last - part.first);
  const std::uint32_t axis = part.is_bucket() ? kNoAxis : longest_axis(centers, members);
  if (axis == kNoAxis) {
    std::ranges::sort(members);  // selection leaves an order that is the library's own
    return;
  }
  const auto middle = members.begin() + static_cast<std::ptrdiff_t>(members.size() / 2);
  std::nth_element(members.begin(), middle, members.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(centers[a][axis], a) < std::pair(centers[b][axis], b);
  });
  planes_[part.node] = {centers[*middle][axis], axis};
  build(part.left(), centers);
  build(part.right(), centers);
}

}  // namespace cairn::stages
