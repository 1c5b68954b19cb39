// The exact neighbourhoods of a leaf's points, with a halo from the leaves around it. What the leaf itself
// holds bounds how far a neighbour can be; other leaves are asked, nearest first, only where the ball of
// that bound reaches them, and only for the part that such balls reach. So no margin is guessed, and
// what is held at a time is two leaves, whatever the balls' sizes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "formats/arrays/external_array.h"
#include "stages/neighbors/distinct_positions.h"
#include "stages/neighbors/leaf_boxes.h"
#include "stages/neighbors/neighbor_set.h"

namespace cairn::stages {

/// Takes the neighbours of the leaf's distinct position number `i`, nearest first: itself, then others.
using TakeNeighbors = std::function<void(std::size_t i, std::span<const Neighbor> neighbors)>;

class NeighborhoodFinder {
 public:
  /// `records` are all points in kd-order, `stride` bytes each. Both must outlive the finder.
  NeighborhoodFinder(formats::ExternalArray& records, std::size_t stride, const LeafBoxes& boxes,
                     std::size_t neighbors)
      : records_(records), stride_(stride), boxes_(boxes), neighbors_(neighbors) {}

  /// Calls `take` once for each distinct position of a leaf, in no particular order, with the `neighbors`
  /// least of all distinct positions of the cloud by (distance, position), or all if there are fewer.
  /// Several leaves may be handled at a time.
  void find(std::uint64_t leaf, const DistinctPositions& points, const TakeNeighbors& take) const;

  /// Memory that one call of `find` may hold beside its points.
  static std::uint64_t find_bytes(std::uint64_t leaf_points, std::size_t neighbors);

 private:
  /// A position whose neighbours may lie in other leaves.
  struct Open {
    std::size_t point;
    NeighborSet nearest;
  };

  bool is_closed(const formats::GridPoint& p, double reach, std::uint64_t leaf,
                 NearLeaves& near) const;
  void ask_other_leaves(const DistinctPositions& points, NearLeaves& near,
                        std::vector<Open>& open) const;
  void ask_leaf(std::uint64_t leaf, const DistinctPositions& points,
                std::span<Open* const> askers) const;
  formats::GridBox reached_part(const formats::GridBox& box, const DistinctPositions& points,
                                std::span<Open* const> askers) const;

  formats::ExternalArray& records_;
  std::size_t stride_;
  const LeafBoxes& boxes_;
  std::size_t neighbors_;
};

}  // namespace cairn::stages
