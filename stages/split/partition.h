// One step of the split: the records of a node, distributed to its children in one stable pass. Records
// of equal coordinates keep their order, and the order of the input is itself fixed by the campaign, so
// the division follows a total order however many identical points there are.
#pragma once

#include <span>
#include <vector>

#include "stages/split/record_source.h"

namespace cairn::stages {

/// Where a partition puts its records: consecutive 12-byte grid positions with attributes.
struct PartitionTarget {
  formats::ExternalArray* array = nullptr;
  std::uint64_t first_byte = 0;
  std::size_t stride = 0;
};

/// Distributes the records of `slabs`, whose tight box is `box`, to children along the box's longest
/// axis (in world units, by `step`). `starts` holds the children's first ranks and, last, the number of
/// records: child i gets the records of ranks [starts[i], starts[i + 1]). Returns their tight boxes. Tells
/// the progress of every slab once.
std::vector<formats::GridBox> partition(std::span<const Slab> slabs, const formats::GridBox& box,
                                        const std::array<double, 3>& step,
                                        std::span<const std::uint64_t> starts,
                                        const PartitionTarget& target, const PassMode& mode);

}  // namespace cairn::stages
