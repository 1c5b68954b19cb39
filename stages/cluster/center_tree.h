// Which of many centers are near a place: a tree of bounding boxes over runs of eight.
// Based on: J. Goldsmith, J. Salmon, "Automatic creation of object hierarchies for ray tracing", 1987 (boxes of boxes), over
// a given order, as in T. Karras, "Maximizing parallelism in the construction of BVHs", 2012, which sorts along a curve; I.
// Wald et al., "Getting rid of packets", 2008 (as many children as vector registers compare at once).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "stages/cluster/places.h"

namespace cairn::stages {

class CenterTree {
 public:
  /// `centers`: at least one, finite; those that follow each other should be near each other, as along a space-filling
  /// curve, or searches take longer.
  explicit CenterTree(std::span<const Location> centers);

  /// Calls limit = visit(index, square) for centers whose squared distance `square` is below `limit` then, among them all that
  /// are below the limit that is returned last; by index. The limit must not grow. However many centers share one place, those
  /// behind the one that brought the limit down to their distance cost nothing. The time goes with the number of centers below
  /// the first limit, or so.
  template <typename Visit>
  void search(const Location& place, double limit, const Visit& visit) const {
    std::array<Step, std::size_t{kWidth} * kMostLevels> steps;
    std::size_t count = 0;
    steps[count++] = {.square = 0, .level = top_, .node = 0};
    while (count > 0) {
      const Step step = steps[--count];
      if (!(step.square < limit)) continue;
      if (step.level > 0) {
        count += push_children(step, place, limit, &steps[count]);
        continue;
      }
      const Eights squares = buckets_[step.node].squared_distances(place);
      for (std::uint32_t below = those_below(squares, limit); below != 0; below &= below - 1) {
        const auto k = static_cast<std::uint32_t>(std::countr_zero(below));
        if (squares[k] < limit) limit = visit(kWidth * step.node + k, squares[k]);
      }
    }
  }

 private:
  static constexpr std::uint32_t kWidth = 8;
  static constexpr std::uint32_t kMostLevels = 11;  ///< 8^11 > 2^32
  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  using Eights = std::array<double, kWidth>;

  /// Centers, infinitely far where there is none.
  struct alignas(64) Bucket {
    std::array<Eights, 3> at;

    Eights squared_distances(const Location& place) const {
      Eights squares;
      for (std::uint32_t k = 0; k < kWidth; ++k) {
        const double x = at[0][k] - place[0], y = at[1][k] - place[1], z = at[2][k] - place[2];
        squares[k] = x * x + y * y + z * z;
      }
      return squares;
    }
  };
  /// Boxes of children, inside out where there is none.
  struct alignas(64) Boxes {
    std::array<Eights, 3> low, high;

    Eights squared_distances(const Location& place) const {
      Eights squares{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::uint32_t k = 0; k < kWidth; ++k) {
          const double below = low[axis][k] - place[axis], above = place[axis] - high[axis][k];
          const double outside = below > above ? below : above;
          const double positive = outside > 0 ? outside : 0;
          squares[k] += positive * positive;
        }
      return squares;
    }
  };
  struct Step {
    double square;  ///< from the place to the box
    std::uint32_t level, node;
  };

  /// A bit for each.
  static std::uint32_t those_below(const Eights& squares, double limit) {
    std::uint32_t bits = 0;
    for (std::uint32_t k = 0; k < kWidth; ++k)
      bits |= static_cast<std::uint32_t>(squares[k] < limit) << k;
    return bits;
  }

  /// Writes the children that are nearer than the limit, the first last. Returns their number.
  std::size_t push_children(const Step& step, const Location& place, double limit,
                            Step* children) const {
    const Eights squares = boxes_[step.level - 1][step.node].squared_distances(place);
    std::size_t count = 0;
    for (std::uint32_t below = those_below(squares, limit); below != 0;) {
      const auto k = static_cast<std::uint32_t>(std::bit_width(below) - 1);
      below ^= 1U << k;
      children[count++] = {squares[k], step.level - 1, kWidth * step.node + k};
    }
    return count;
  }

  std::vector<Bucket> buckets_;
  std::vector<std::vector<Boxes>>
      boxes_;              ///< of the buckets, of these boxes, and so on up to a single one
  std::uint32_t top_ = 0;  ///< level of that; 0: there is one bucket
};

}  // namespace cairn::stages
