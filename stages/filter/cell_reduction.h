// Points grouped by cells of a lattice, however they are divided into leaves: every leaf brings an entry a point;
// entries of one key are made one; and up the tree, nodes hand to their parent what cells at their planes hold, until
// a cell lies inside of a node. So every group is complete once, and what is held at a time are the cells at the
// planes of some nodes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <span>
#include <vector>

#include "stages/filter/cell_region.h"
#include "stages/parallel.h"

namespace cairn::stages {

/// An Entry has a member `cell` and a key(), which entries of two cells never share, with an order. All functions are
/// called from several threads.
template <typename Entry>
struct CellRules {
  CellOf cell_of;
  /// The entries of a leaf's points.
  std::function<std::vector<Entry>(std::uint64_t leaf)> read;
  /// Puts an entry of the same key into another. Whatever the order, the result must be the same.
  std::function<void(Entry& into, const Entry& other)> absorb;
  /// All entries of a node's points have been put together, as far as they are in it; none: nobody needs to know.
  std::function<void(formats::IndexRange points)> merged;
  /// Takes the entries of cells that are complete, by key. Each cell comes once, in any order.
  std::function<void(std::span<const Entry>)> complete;
};

template <typename Entry>
class CellReduction {
 public:
  CellReduction(const NodeBoxes& nodes, const CellRules<Entry>& rules)
      : nodes_(nodes), rules_(rules) {}

  void run() const { reduce(0, 0, {}); }

 private:
  using Entries = std::vector<Entry>;

  /// The entries of a node's cells that others may have points of too.
  Entries reduce(formats::Level level, std::uint64_t index, const CellRegion& region) const {
    Entries entries =
        put_together(level == nodes_.tree().leaf_level() ? rules_.read(index)
                                                         : reduce_children(level, index, region));
    if (rules_.merged) rules_.merged(nodes_.tree().input_range(level, index));
    const auto open = std::stable_partition(entries.begin(), entries.end(),
                                            [&](const Entry& e) { return region.holds(e.cell); });
    rules_.complete({entries.begin(), open});
    return {std::make_move_iterator(open), std::make_move_iterator(entries.end())};
  }

  Entries reduce_children(formats::Level level, std::uint64_t index,
                          const CellRegion& region) const {
    const std::uint32_t fanout = nodes_.tree().fanout();
    std::vector<Entries> parts(fanout);
    for_each_piece(fanout, [&](std::uint64_t i) {
      const auto child = static_cast<std::uint32_t>(i);
      parts[i] = reduce(level + 1, index * fanout + i,
                        nodes_.child_region(level, index, child, region, rules_.cell_of));
    });
    Entries all;
    for (Entries& part : parts) {
      all.insert(all.end(), part.begin(), part.end());
      Entries().swap(part);
    }
    return all;
  }

  Entries put_together(Entries entries) const {
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.key() < b.key(); });
    std::size_t last = 0;
    for (std::size_t i = 1; i < entries.size(); ++i) {
      if (entries[i].key() == entries[last].key())
        rules_.absorb(entries[last], entries[i]);
      else
        entries[++last] = entries[i];
    }
    if (!entries.empty()) entries.resize(last + 1);
    return entries;
  }

  const NodeBoxes& nodes_;
  const CellRules<Entry>& rules_;
};

}  // namespace cairn::stages
