// Merging inside one list of clusters: the pair whose union adds least squared error over the surface, among those
// whose normals deviate by less than the threshold, until the list is as short as asked.
// Based on: Goswami et al. 2010, section III.B (clusters within a cell, threshold theta relaxed where
// it blocks); J. Ward, "Hierarchical grouping to optimize an objective function", 1963 (the merging
// cost, here with the area that a cluster covers in place of its points, so that dense parts get no more than their share);
// all reciprocal nearest pairs of a round merge at once.
#pragma once

#include <array>
#include <cstdint>

#include "stages/cluster/cell_lists.h"

namespace cairn::stages {

/// The clusters of one list, as columns. Coordinates relative to the list, in any one unit.
struct alignas(64) MergeList {
  std::array<float, kMaxListLength> x, y, z;
  std::array<float, kMaxListLength> weight;  ///< input points: centers and normals are their means
  std::array<float, kMaxListLength> area;    ///< covered, in any one unit; above 0
  std::array<float, kMaxListLength> cost;    ///< of the merge that made it; 0 of none
  std::array<float, kMaxListLength> nx, ny,
      nz;  ///< mean normal, unit; all zero: none, agrees with every other
  std::array<std::uint32_t, kMaxListLength> id;  ///< of the caller's
  std::uint32_t count = 0;
  bool has_normals = true;  ///< else they are not looked at
};

struct ThetaRule {
  float start_degrees = 15;  ///< 0 to 180
  float relaxation = 1.5F;   ///< factor, but by one degree at least
};

/// Cluster `loser` became part of cluster `winner`.
struct Merge {
  std::uint32_t winner;
  std::uint32_t loser;
  /// What the merge adds to the squared error, times the square of how many times theta is what it was at first (of
  /// one degree, if that is more). Not below the cost of a merge that it builds on: the cheapest merges of a list, or
  /// of several, can be done without the others.
  float cost;
  float theta_degrees;  ///< the threshold that it needed
};

struct MergeOutcome {
  std::array<Merge, kMaxListLength> merges;  ///< in the order in which they happened
  std::uint32_t count = 0;
  std::uint32_t rounds = 0;  ///< in which all pairs were looked at
};

/// Shortens the list to `target` clusters (1 <= target <= count) and leaves it in no certain state. Where no pair is within
/// theta, theta is relaxed for this list alone. Deterministic: of equal costs those count as less whose two indices have
/// the smaller bitwise difference, then those of the smaller index.
MergeOutcome merge_pairs(MergeList& list, std::uint32_t target, ThetaRule theta);

}  // namespace cairn::stages
