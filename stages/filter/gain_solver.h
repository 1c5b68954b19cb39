// From how much brighter scans are than each other where they overlap to the gains that make them agree.
// Based on: M. Brown, D. G. Lowe, "Automatic Panoramic Image Stitching using Invariant Features", 2007, section 6
// (gain compensation). Departs from it in that gains are fitted as logarithms, which makes the problem linear without
// an answer of gains that are all zero, and in that voxels take the place of overlapping images.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "formats/wide_int.h"

namespace cairn::stages {

/// What two scans have in common. Sums are whole numbers, so that their order does not matter.
class Overlap {
 public:
  /// A place where the first scan is by `log_ratio` (a natural logarithm, |log_ratio| < 100) brighter than the second.
  /// `weight`: the inverse variance of that ratio, of the points that tell it; at most 2^40.
  void add(double log_ratio, double weight);
  void add(const Overlap& other);

  double weight() const;
  double weighted_log_ratio() const;

 private:
  formats::Int128 weight_ = 0;
  formats::Int128 log_ratio_ = 0;
};

/// By pairs of scans, the lower number first.
using Overlaps = std::map<std::pair<std::uint32_t, std::uint32_t>, Overlap>;

/// The logarithms of the gains of `scans` scans that bring the overlaps nearest to agreement, by weighted least
/// squares. Every scan is held at gain 1 with the weight 1 of about one shared point, as in the paper: little overlap
/// moves little, none nothing. Of scans that are joined by overlaps the mean is 0.
std::vector<double> solve_log_gains(const Overlaps& overlaps, std::size_t scans);

}  // namespace cairn::stages
