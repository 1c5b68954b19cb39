#include "stages/neighbors/block_index.h"

#include <algorithm>
#include <cmath>

#include "formats/vector_path.h"

namespace cairn::stages {

using formats::GridPoint;

namespace {

constexpr std::size_t kLanes = BlockIndex::kBlock;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// More than what the rounding of a distance may lose.
constexpr double kRoundUp = 1 + 1e-9;

}  // namespace

BlockIndex::BlockIndex(std::span<const GridPoint> positions, const std::array<double, 3>& step)
    : step_(step), blocks_((positions.size() + kBlock - 1) / kBlock) {
  std::vector<Boxes> level = empty_boxes(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::size_t count = std::min(kBlock, positions.size() - b * kBlock);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Lanes<double>& column = blocks_[b][axis];
      column.fill(kNothing);
      for (std::size_t k = 0; k < count; ++k) column[k] = positions[b * kBlock + k][axis];
      const auto [low, high] = std::minmax_element(column.data(), column.data() + count);
      level[b / kBlock].low[axis][b % kBlock] = *low;
      level[b / kBlock].high[axis][b % kBlock] = *high;
    }
  }
  levels_.push_back(std::move(level));
  while (levels_.back().size() > 1) {
    const std::vector<Boxes>& below = levels_.back();
    level = empty_boxes(below.size());
    for (std::size_t b = 0; b < below.size(); ++b)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        level[b / kBlock].low[axis][b % kBlock] = *std::ranges::min_element(below[b].low[axis]);
        level[b / kBlock].high[axis][b % kBlock] = *std::ranges::max_element(below[b].high[axis]);
      }
    levels_.push_back(std::move(level));
  }
}

/// For so many children.
std::vector<BlockIndex::Boxes> BlockIndex::empty_boxes(std::size_t children) {
  Boxes empty;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    empty.low[axis].fill(kInfinite);
    empty.high[axis].fill(-kInfinite);
  }
  return std::vector<Boxes>((children + kBlock - 1) / kBlock, empty);
}

inline void BlockSearch::run(BlockSearch& search, std::span<const Query> queries) {
  search.find_blocks(queries);
  for (const Query& query : queries) {
    search.collect(query, search.bound(query));
    search.last_at_ = query.at;
    search.last_reach_ = query.nearest->reach();
  }
}

/// No neighbour of a query is farther: around it lie at least those of the query before.
inline double BlockSearch::bound(const Query& query) const {
  if (query.nearest->full() || last_reach_ == kInfinite) return query.nearest->reach();
  double squared = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double d = index_.step_[axis] * (double{1} * query.at[axis] - last_at_[axis]);
    squared += d * d;
  }
  const double way = std::sqrt(last_reach_) + std::sqrt(squared);
  return way * way * kRoundUp;
}

inline void BlockSearch::find_blocks(std::span<const Query> queries) {
  GridPoint low = queries.front().at, high = low;
  double reach = 0;
  for (const Query& query : queries) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], query.at[axis]);
      high[axis] = std::max(high[axis], query.at[axis]);
    }
    reach = std::max(reach, bound(query));
  }
  // From the top of the tree down: of each level the nodes that are near enough.
  blocks_.assign(1, 0);
  for (std::size_t level = index_.levels_.size(); level-- > 0;) {
    parents_.swap(blocks_);
    blocks_.clear();
    boxes_.clear();
    for (const std::uint32_t parent : parents_)
      add_children(index_.levels_[level][parent], parent, low, high, reach);
  }
  near_.resize(boxes_.size() * kLanes);
}

/// Adds the children of a node of the tree that are within `reach` of a box to `blocks_` and `boxes_`.
inline void BlockSearch::add_children(const BlockIndex::Boxes& children, std::uint32_t parent,
                                      const GridPoint& low, const GridPoint& high, double reach) {
  Lanes<double> distance;
  box_distances(low, high, children, distance);
  for (std::uint32_t k = 0; k < kLanes; ++k) {
    // An infinite one is that of no child.
    if (distance[k] > reach || distance[k] == kInfinite) continue;
    if (blocks_.size() % kLanes == 0) boxes_.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      boxes_.back().low[axis][blocks_.size() % kLanes] = children.low[axis][k];
      boxes_.back().high[axis][blocks_.size() % kLanes] = children.high[axis][k];
    }
    blocks_.push_back(parent * static_cast<std::uint32_t>(kLanes) + k);
  }
}

/// Those of the blocks within `reach` of a position stand first in `near_`. Returns how many.
inline std::size_t BlockSearch::find_near(const GridPoint& at, double reach) {
  std::size_t count = 0;
  Lanes<double> distance;
  for (std::size_t first = 0; first < blocks_.size(); first += kLanes) {
    box_distances(at, at, boxes_[first / kLanes], distance);
    const std::size_t end = std::min(kLanes, blocks_.size() - first);
    for (std::size_t k = 0; k < end; ++k) {
      near_[count] = blocks_[first + k];
      count += distance[k] <= reach ? 1 : 0;
    }
  }
  return count;
}

/// Adds the positions of the blocks that are within `reach` to the query's neighbours, some blocks at a time.
inline void BlockSearch::collect(const Query& query, double reach) {
  const std::size_t blocks = find_near(query.at, reach);
  for (std::size_t first = 0; first < blocks; first += kBlocksAtOnce) {
    const std::span<const std::uint32_t> at_once(
        near_.data() + first, std::min<std::size_t>(kBlocksAtOnce, blocks - first));
    for (std::size_t b = 0; b < at_once.size(); ++b)
      distances(query.at, index_.blocks_[at_once[b]], distance_[b]);
    std::size_t found = 0;
    for (std::uint32_t b = 0; b < at_once.size(); ++b)
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        found_[found] = b * static_cast<std::uint32_t>(kLanes) + k;
        found += distance_[b][k] <= reach ? 1 : 0;
      }
    if (found == 0) continue;
    settle(query, at_once, found);
    reach = std::min(reach, query.nearest->reach());
  }
}

/// Moves what was found in some blocks into the query's set.
inline void BlockSearch::settle(const Query& query, std::span<const std::uint32_t> blocks,
                                std::size_t found) {
  for (std::size_t i = 0; i < found; ++i)
    key_[i] = static_cast<float>(distance_[found_[i] / kLanes][found_[i] % kLanes]);
  rank_by_counting(found);
  // With the last neighbour come those whose keys do not tell them from it.
  std::size_t kept = std::min(found, query.nearest->capacity());
  while (kept < found && key_[order_[kept]] == key_[order_[kept - 1]]) ++kept;
  ranked_.resize(kept);
  for (std::size_t r = 0; r < kept; ++r) {
    const std::uint32_t place = found_[order_[r]], k = place % kLanes;
    const BlockIndex::Columns& position = index_.blocks_[blocks[place / kLanes]];
    ranked_[r].squared_distance = distance_[place / kLanes][k];
    for (std::size_t axis = 0; axis < 3; ++axis)
      ranked_[r].position[axis] = static_cast<std::int32_t>(position[axis][k]);
  }
  for (std::size_t r = 1; r < kept; ++r)
    for (std::size_t at = r; at > 0 && is_before(ranked_[at], ranked_[at - 1]); --at)
      std::swap(ranked_[at], ranked_[at - 1]);
  query.nearest->merge(ranked_);
}

/// Orders what was found by its keys: of each are counted those that are less; equal ones keep their order.
inline void BlockSearch::rank_by_counting(std::size_t count) {
  std::fill_n(equals_.begin(), count, std::uint16_t{0});
  for (std::size_t first = 0; first < count; first += kLanes) {
    Lanes<float> own;
    std::copy_n(key_.data() + first, kLanes, own.data());
    Lanes<std::uint32_t> less{};
    for (std::size_t i = 0; i < count; ++i) {
      const float other = key_[i];
#pragma omp simd
      for (std::size_t k = 0; k < kLanes; ++k) less[k] += other < own[k] ? 1U : 0U;
    }
    const std::size_t end = std::min(kLanes, count - first);
    for (std::size_t k = 0; k < end; ++k)
      order_[less[k] + equals_[less[k]]++] = static_cast<std::uint32_t>(first + k);
  }
}

/// As formats::squared_distance rounds them.
inline void BlockSearch::distances(const GridPoint& from, const BlockIndex::Columns& to,
                                   Lanes<double>& distance) const {
  const double at_x = from[0], at_y = from[1], at_z = from[2];
  const double step_x = index_.step_[0], step_y = index_.step_[1], step_z = index_.step_[2];
#pragma omp simd
  for (std::size_t k = 0; k < kLanes; ++k) {
    const double x = step_x * (to[0][k] - at_x), y = step_y * (to[1][k] - at_y),
                 z = step_z * (to[2][k] - at_z);
    distance[k] = x * x + y * y + z * z;
  }
}

/// Between a box and 16 others. Rounding is monotone: no two positions in them are nearer, as their distance is rounded.
inline void BlockSearch::box_distances(const GridPoint& low, const GridPoint& high,
                                       const BlockIndex::Boxes& boxes,
                                       Lanes<double>& distance) const {
  distance.fill(0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = index_.step_[axis], from = low[axis], to = high[axis];
    const Lanes<double>&below = boxes.low[axis], &above = boxes.high[axis];
#pragma omp simd
    for (std::size_t k = 0; k < kLanes; ++k) {
      // One of them at least is not positive. Not the larger of both first: GCC makes branches of that, and no vectors.
      const double right = below[k] - to, left = from - above[k];
      const double d = step * ((right > 0 ? right : 0) + (left > 0 ? left : 0));
      distance[k] += d * d;
    }
  }
}

void BlockSearch::search(std::span<const Query> queries) {
  if (!queries.empty()) formats::vectorized<&BlockSearch::run>(*this, queries);
}

}  // namespace cairn::stages
