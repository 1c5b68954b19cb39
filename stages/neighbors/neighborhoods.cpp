#include "stages/neighbors/neighborhoods.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stages/neighbors/block_index.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;
using formats::IndexRange;

namespace {

/// Open positions wait until this many bytes are theirs; then the other leaves are asked for all of them.
constexpr std::size_t kOpenBytes = std::size_t{16} << 20;

std::size_t open_limit(std::size_t neighbors) {
  return std::max<std::size_t>(64, kOpenBytes / (neighbors * sizeof(Neighbor) + 64));
}

/// The largest or smallest step from p that lies within `radius`, kept inside [least, most]. A step
/// more than the quotient's rounding may lose.
std::int32_t stepped(std::int32_t p, double radius, double step, int sign, std::int32_t least,
                     std::int32_t most) {
  const double steps = std::min(std::ceil(radius / step) + 1, 4294967296.0);
  const std::int64_t to = p + sign * static_cast<std::int64_t>(steps);
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(to, least, most));
}

}  // namespace

void NeighborhoodFinder::find(std::uint64_t leaf, const DistinctPositions& points,
                              const TakeNeighbors& take) const {
  const BlockIndex own(points.positions, boxes_.step());
  NearLeaves near(boxes_, leaf);
  std::vector<Open> open;
  const auto settle_open = [&] {
    ask_other_leaves(points, near, open);
    for (Open& settled : open) take(settled.point, settled.nearest.sorted());
    open.clear();
  };
  std::vector<NeighborSet> nearest(BlockIndex::kBlock, NeighborSet(neighbors_));
  BlockSearch search(own);
  std::vector<BlockSearch::Query> queries;
  for (std::size_t first = 0; first < points.positions.size(); first += BlockIndex::kBlock) {
    const std::size_t count = std::min(BlockIndex::kBlock, points.positions.size() - first);
    queries.clear();
    for (std::size_t i = 0; i < count; ++i) {
      nearest[i].clear();
      queries.push_back({points.positions[first + i], &nearest[i]});
    }
    search.search(queries);
    for (std::size_t i = 0; i < count; ++i) {
      if (is_closed(queries[i].at, nearest[i].reach(), leaf, near))
        take(first + i, nearest[i].sorted());
      else
        open.push_back({first + i, nearest[i]});
    }
    if (open.size() >= open_limit(neighbors_)) settle_open();
  }
  settle_open();
}

/// Whether no other leaf can hold a position within `reach` of p.
bool NeighborhoodFinder::is_closed(const GridPoint& p, double reach, std::uint64_t leaf,
                                   NearLeaves& near) const {
  const GridBox& box = boxes_.leaf(leaf);
  bool inside = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double margin =
        boxes_.step()[axis] * static_cast<double>(std::min(std::int64_t{p[axis]} - box.min[axis],
                                                           std::int64_t{box.max[axis]} - p[axis]));
    inside = inside && margin * margin > reach;
  }
  // Leaves meet at planes: nothing of another leaf lies inside this one's box, though it may on its faces.
  if (inside) return true;
  const NearLeaves::Near* other = nullptr;
  for (std::size_t n = 0; (other = near.at(n)) != nullptr && other->squared_distance <= reach; ++n)
    if (squared_distance(boxes_.step(), p, boxes_.leaf(other->leaf)) <= reach) return false;
  return true;
}

void NeighborhoodFinder::ask_other_leaves(const DistinctPositions& points, NearLeaves& near,
                                          std::vector<Open>& open) const {
  std::vector<Open*> askers;
  const NearLeaves::Near* other = nullptr;
  for (std::size_t n = 0; (other = near.at(n)) != nullptr; ++n) {
    askers.clear();
    bool any_reaches = false;
    for (Open& asker : open) {
      const double reach = asker.nearest.reach();
      any_reaches = any_reaches || other->squared_distance <= reach;
      if (squared_distance(boxes_.step(), points.positions[asker.point],
                           boxes_.leaf(other->leaf)) <= reach)
        askers.push_back(&asker);
    }
    // Those that follow are farther still.
    if (!any_reaches) return;
    if (!askers.empty()) ask_leaf(other->leaf, points, askers);
  }
}

void NeighborhoodFinder::ask_leaf(std::uint64_t leaf, const DistinctPositions& points,
                                  std::span<Open* const> askers) const {
  const GridBox& box = boxes_.leaf(leaf);
  std::vector<GridPoint> halo;
  if (box.min == box.max) {
    halo.push_back(box.min);
  } else {
    const IndexRange range = boxes_.tree().input_range(boxes_.tree().leaf_level(), leaf);
    const std::uint64_t offset = range.first * stride_, size_bytes = range.count * stride_;
    halo = distinct_within(std::as_const(records_).bytes().subspan(offset, size_bytes), stride_,
                           reached_part(box, points, askers));
    records_.release(offset, size_bytes);
  }
  if (halo.empty()) return;
  const BlockIndex index(halo, boxes_.step());
  BlockSearch search(index);
  std::vector<BlockSearch::Query> queries;
  for (Open* asker : askers) {
    queries.push_back({points.positions[asker->point], &asker->nearest});
    if (queries.size() < BlockIndex::kBlock && asker != askers.back()) continue;
    search.search(queries);
    queries.clear();
  }
}

/// The part of another leaf's box that holds all that the askers' balls reach of it.
GridBox NeighborhoodFinder::reached_part(const GridBox& box, const DistinctPositions& points,
                                         std::span<Open* const> askers) const {
  GridBox part;
  for (const Open* asker : askers) {
    const GridPoint& p = points.positions[asker->point];
    const double radius = std::sqrt(asker->nearest.reach());
    GridBox ball;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = boxes_.step()[axis];
      ball.min[axis] = stepped(p[axis], radius, step, -1, box.min[axis], box.max[axis]);
      ball.max[axis] = stepped(p[axis], radius, step, +1, box.min[axis], box.max[axis]);
    }
    part.add(ball);
  }
  return part;
}

std::uint64_t NeighborhoodFinder::find_bytes(std::uint64_t leaf_points, std::size_t neighbors) {
  const std::uint64_t index = leaf_points * (BlockIndex::kBytesPerPosition + sizeof(GridPoint));
  return 2 * index + open_limit(neighbors) * (neighbors * sizeof(Neighbor) + 64);
}

}  // namespace cairn::stages
