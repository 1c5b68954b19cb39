// The nearest positions of one position, as far as they are known: what a search adds to, leaf by leaf.
#pragma once

#include <algorithm>
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

/// Neighbors' order.
inline bool is_before(const Neighbor& a, const Neighbor& b) {
  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                  : a.position < b.position;
}

/// The `capacity` least of the neighbours that were added, in order.
class NeighborSet {
 public:
  explicit NeighborSet(std::size_t capacity) : slots_(capacity) {}

  void clear() { count_ = 0; }
  std::size_t capacity() const { return slots_.size(); }
  bool full() const { return count_ == slots_.size(); }
  /// No position farther than this can enter: a squared distance, infinite until the set is full.
  double reach() const {
    return full() ? slots_.back().squared_distance : std::numeric_limits<double>::infinity();
  }
  /// Adds neighbours in their order, no two the same; the set may hold some of them already.
  void merge(std::span<const Neighbor> more) {
    if (count_ == 0) {
      count_ = std::min(more.size(), slots_.size());
      std::copy_n(more.begin(), count_, slots_.begin());
      return;
    }
    const std::vector<Neighbor> held(sorted().begin(), sorted().end());
    std::size_t a = 0, b = 0;
    for (count_ = 0; count_ < slots_.size() && (a < held.size() || b < more.size()); ++count_) {
      const bool of_held = b == more.size() || (a < held.size() && !is_before(more[b], held[a]));
      slots_[count_] = of_held ? held[a] : more[b];
      if (of_held && b < more.size() && held[a] == more[b]) ++b;
      of_held ? ++a : ++b;
    }
  }
  /// All neighbours, nearest first.
  std::span<const Neighbor> sorted() const { return std::span(slots_).first(count_); }

 private:
  std::vector<Neighbor> slots_;
  std::size_t count_ = 0;
};

}  // namespace cairn::stages
