// Which of many centers is nearest to each of many points, where both follow a space-filling curve: a tree of bounding boxes
// over runs of centers, searched by runs of points together.
// Based on: J. Goldsmith, J. Salmon, "Automatic creation of object hierarchies for ray tracing", 1987 (boxes of boxes), over
// a given order, as in T. Karras, "Maximizing parallelism in the construction of BVHs", 2012, which sorts along a curve; I.
// Wald et al., "Interactive rendering with coherent ray tracing", 2001 (packets), here of points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/cluster/curve_points.h"

namespace cairn::stages {

class CenterTree {
 public:
  /// `centers`: at least one, finite, in the coordinates of the points that will ask; those that follow each other should be
  /// near each other, as along a space-filling curve, or searches take longer.
  explicit CenterTree(CurvePoints centers);

  /// `center_of`: for each point one of the centers; afterwards the nearest one, if that is nearer than its own and if its
  /// normal agrees with the point's to `min_cosine`, or as much as that of its own center does. Distances are compared in
  /// single precision, to some millionths of the longest among a few points that follow each other. However many centers
  /// share one place, those behind the first few cost nothing.
  void move_to_nearest(const CurvePoints& points, float min_cosine,
                       std::span<std::uint32_t> center_of) const;

 private:
  friend class PacketSearch;

  static constexpr std::uint32_t kLanes = 16;      ///< as many as the widest vectors hold
  static constexpr std::uint32_t kMostLevels = 8;  ///< 16^8 = 2^32
  template <typename T>
  using Lanes = std::array<T, kLanes>;

  /// Boxes of children, rounded outwards; inside out where there is none.
  struct alignas(64) Boxes {
    std::array<Lanes<float>, 3> low, high;
  };

  CurvePoints centers_;  ///< whole runs of kLanes: behind the last center others, infinitely far
  std::vector<std::vector<Boxes>>
      boxes_;  ///< of runs of centers, of kLanes of these boxes, and so on up to a single one
};

}  // namespace cairn::stages
