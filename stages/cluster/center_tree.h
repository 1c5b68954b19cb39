// Which of many centers are near a place: a balanced kd-tree of them.
// Source: J. Bentley, "Multidimensional binary search trees used for associative searching", 1975; J. Friedman, J. Bentley,
// R. Finkel, "An algorithm for finding best matches in logarithmic expected time", 1977 (buckets, order of the search).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/cluster/places.h"

namespace cairn::stages {

class CenterTree {
 public:
  /// `centers`: at least one, finite.
  explicit CenterTree(std::span<const Location> centers);

  /// Calls limit = visit(index, square) for centers whose squared distance `square` is below `limit` then, among them all that
  /// are below the limit that is returned last; always in the same order. The limit must not grow. However many centers share
  /// one place, those behind the one that brought the limit down to their distance cost nothing.
  template <typename Visit>
  void search(const Location& place, double limit, const Visit& visit) const {
    descend({0, 0, static_cast<std::uint32_t>(order_.size())}, place, limit, visit);
  }

 private:
  static constexpr std::uint32_t kBucket = 8;
  static constexpr std::uint32_t kNoAxis = 3;

  /// Children of node i are 2 i + 1 and 2 i + 2; they share its centers half and half. Small parts have none, nor have those
  /// whose centers all lie at one place.
  struct Part {
    std::uint32_t node, first, last;

    bool is_bucket() const { return last - first <= kBucket; }
    Part left() const { return {2 * node + 1, first, first + (last - first) / 2}; }
    Part right() const { return {2 * node + 2, first + (last - first) / 2, last}; }
  };
  struct Plane {
    double at = 0;
    std::uint32_t axis = kNoAxis;  ///< that: all at one place
  };

  static std::uint32_t longest_axis(std::span<const Location> centers,
                                    std::span<const std::uint32_t> members);
  void build(const Part& part, std::span<const Location> centers);

  template <typename Visit>
  void descend(const Part& part, const Location& place, double& limit, const Visit& visit) const {
    if (part.is_bucket()) {
      for (std::uint32_t i = part.first; i < part.last; ++i)
        if (const double square = squared_distance(place, sorted_[i]); square < limit)
          limit = visit(order_[i], square);
      return;
    }
    const Plane& plane = planes_[part.node];
    if (plane.axis == kNoAxis) {
      const double square = squared_distance(place, sorted_[part.first]);
      for (std::uint32_t i = part.first; i < part.last && square < limit; ++i)
        limit = visit(order_[i], square);
      return;
    }
    const double beyond = place[plane.axis] - plane.at;
    descend(beyond < 0 ? part.left() : part.right(), place, limit, visit);
    if (beyond * beyond < limit)
      descend(beyond < 0 ? part.right() : part.left(), place, limit, visit);
  }

  std::vector<std::uint32_t> order_;  ///< of the centers, by buckets
  std::vector<Location> sorted_;      ///< in that order
  std::vector<Plane> planes_;
};

}  // namespace cairn::stages
