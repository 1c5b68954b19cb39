// The nearest positions of one position, as far as they are known: what a search adds to, leaf by leaf.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "formats/dataset/grid.h"

namespace cairn::stages {

struct Neighbor {
  double squared_distance = 0;  ///< world units, as formats::squared_distance rounds it
  formats::GridPoint position{};

  /// A total order, so that which of several equally far positions is a neighbour depends neither on the
  /// order in which they are met nor on how the points are divided.
  friend auto operator<=>(const Neighbor&, const Neighbor&) = default;
};

/// The `capacity` least of the neighbours that were added, in order. Kept so by insertion: most are
/// turned away at the end or stop near it.
class NeighborSet {
 public:
  explicit NeighborSet(std::size_t capacity) : slots_(capacity) {}

  void clear() { count_ = 0; }
  bool full() const { return count_ == slots_.size(); }
  /// No position farther than this can enter: a squared distance, infinite until the set is full.
  double reach() const {
    return full() ? slots_.back().squared_distance : std::numeric_limits<double>::infinity();
  }
  bool holds(const Neighbor& neighbor) const;
  /// Requires a position that the set does not hold.
  void add(const Neighbor& neighbor);
  /// All neighbours, nearest first.
  std::span<const Neighbor> sorted() const { return std::span(slots_).first(count_); }

 private:
  std::vector<Neighbor> slots_;
  std::size_t count_ = 0;
};

}  // namespace cairn::stages
