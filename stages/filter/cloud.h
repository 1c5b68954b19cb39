// What effects work on: the records of all points, and what is decided of them so far.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/bytes.h"
#include "formats/dataset/gain.h"
#include "formats/dataset/grid.h"
#include "stages/neighbors/leaf_records.h"

namespace cairn::stages {

struct Cloud {
  LeafRecords leaves;
  const formats::Grid& grid;
  std::vector<formats::GridBox> boxes;  ///< of the leaves
  bool numbered;                        ///< records end in the number of their scan
  std::size_t scans;
  /// A byte for each point, in the order of the records: 0, or the mark of the effect that removed it.
  formats::ExternalArray marks;
  std::optional<formats::BalancedColumn> balanced;  ///< if exposure is balanced: what that is
  std::vector<formats::Gains> gains;                ///< of each scan, if exposure is balanced

  /// Bytes of a record without its number.
  std::size_t content_bytes() const {
    return leaves.stride() - (numbered ? sizeof(std::uint32_t) : 0);
  }
  std::uint32_t scan_of(const std::byte* record) const {
    return numbered ? formats::load_le<std::uint32_t>(record + content_bytes()) : 0;
  }
  std::uint8_t mark_of(std::uint64_t point) const {
    return std::to_integer<std::uint8_t>(marks.bytes()[point]);
  }
  void mark(std::uint64_t point, std::uint8_t mark) { marks.bytes()[point] = std::byte{mark}; }

  /// Calls visit(point, record) for the points of a leaf that are not removed, in order.
  template <typename Visit>
  void for_each_kept(std::uint64_t leaf, Visit&& visit) const {
    const formats::IndexRange range = leaves.range_of(leaf);
    const std::byte* record = leaves.of(leaf).data();
    for (std::uint64_t i = range.first; i < range.end(); ++i, record += leaves.stride())
      if (mark_of(i) == 0) visit(i, record);
  }
  /// Gives the pages of a leaf's records and marks back.
  void release(std::uint64_t leaf) {
    leaves.release(leaf);
    marks.release(leaves.range_of(leaf).first, leaves.range_of(leaf).count);
  }
};

}  // namespace cairn::stages
