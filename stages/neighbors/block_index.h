// Exact search for the nearest of many positions along a curve, for many queries that lie close together.
// Positions stand in blocks of 16, which the curve keeps compact, with their boxes; what blocks may matter is
// found once for a whole packet of queries, the distances to a block come out of one vector loop, and what is near
// enough is ranked by counting. So nothing is walked through or sorted that would have to be predicted.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "formats/dataset/grid.h"
#include "stages/neighbors/neighbor_set.h"

namespace cairn::stages {

class BlockIndex {
 public:
  static constexpr std::size_t kBlock = 16;

  /// Any order of the positions is right; along a curve it is fast. `step` is the grid's.
  BlockIndex(std::span<const formats::GridPoint> positions, const std::array<double, 3>& step);

  /// Memory of an index.
  static constexpr std::uint64_t kBytesPerPosition = 32;

 private:
  friend class BlockSearch;

  template <typename T>
  using Lanes = std::array<T, kBlock>;
  /// Three columns of 16 coordinates in grid steps, which doubles hold exactly.
  using Columns = std::array<Lanes<double>, 3>;

  struct Boxes {
    Columns low, high;
  };

  static std::vector<Boxes> empty_boxes(std::size_t children);

  std::array<double, 3> step_;
  std::vector<Columns> blocks_;  ///< NaN where there is no position: near to nothing
  /// A tree of 16 children a node, the lowest level first: boxes of blocks, empty where there are fewer; then boxes of
  /// these; the last is the root.
  std::vector<std::vector<Boxes>> levels_;
};

/// Searches an index; holds what a search needs, so one a worker.
class BlockSearch {
 public:
  /// One position that is searched for, and what is known of its neighbours.
  struct Query {
    formats::GridPoint at;
    NeighborSet* nearest;
  };

  /// `index` must outlive it.
  explicit BlockSearch(const BlockIndex& index) : index_(index) {}

  /// Adds to the set of each query what the index holds of its neighbours. Fast where the queries lie close together,
  /// and close to those before.
  void search(std::span<const Query> queries);

 private:
  template <typename T>
  using Lanes = BlockIndex::Lanes<T>;

  static void run(BlockSearch& search, std::span<const Query> queries);
  double bound(const Query& query) const;
  void find_blocks(std::span<const Query> queries);
  void add_children(const BlockIndex::Boxes& children, std::uint32_t parent,
                    const formats::GridPoint& low, const formats::GridPoint& high, double reach);
  std::size_t find_near(const formats::GridPoint& at, double reach);
  void collect(const Query& query, double reach);
  void settle(const Query& query, std::span<const std::uint32_t> blocks, std::size_t found);
  void rank_by_counting(std::size_t count);
  void distances(const formats::GridPoint& from, const BlockIndex::Columns& to,
                 Lanes<double>& distance) const;
  void box_distances(const formats::GridPoint& low, const formats::GridPoint& high,
                     const BlockIndex::Boxes& boxes, Lanes<double>& distance) const;

  const BlockIndex& index_;
  formats::GridPoint last_at_{};  ///< the query before, and how far its neighbours reach
  double last_reach_ = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> blocks_;  ///< that may hold neighbours of a query of the packet
  std::vector<std::uint32_t> parents_;
  std::vector<BlockIndex::Boxes> boxes_;  ///< theirs
  std::vector<std::uint32_t> near_;       ///< those of them that are near enough to one query

  /// What is found in so many blocks is ranked together.
  static constexpr std::size_t kBlocksAtOnce = 16;
  template <typename T>
  using Found = std::array<T, kBlocksAtOnce * BlockIndex::kBlock>;
  std::array<Lanes<double>, kBlocksAtOnce> distance_{};
  Found<std::uint32_t> found_{};   ///< places in `distance_`
  Found<float> key_{};             ///< of each of them the distance, rounded
  Found<std::uint32_t> order_{};   ///< places in `found_`, by their keys
  Found<std::uint16_t> equals_{};  ///< that came before, a rank
  std::vector<Neighbor> ranked_;
};

}  // namespace cairn::stages
