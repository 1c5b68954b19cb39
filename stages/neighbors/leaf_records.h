// The records of a cloud in kd-order, leaf by leaf: what stages that look at one leaf after the other share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/dataset/grid.h"
#include "formats/dataset/tree.h"
#include "stages/context.h"

namespace cairn::stages {

class LeafRecords {
 public:
  /// `array` holds all points of `tree` in kd-order, `stride` bytes each, a 12-byte grid position first. Both must
  /// outlive it.
  LeafRecords(formats::ExternalArray& array, std::size_t stride, const formats::Tree& tree)
      : array_(array), stride_(stride), tree_(tree) {}

  formats::ExternalArray& array() const { return array_; }
  std::size_t stride() const { return stride_; }
  const formats::Tree& tree() const { return tree_; }

  std::uint64_t leaves() const { return tree_.nodes_on(tree_.leaf_level()); }
  formats::IndexRange range_of(std::uint64_t leaf) const {
    return tree_.input_range(tree_.leaf_level(), leaf);
  }
  std::span<const std::byte> of(std::uint64_t leaf) const {
    const formats::IndexRange range = range_of(leaf);
    return std::as_const(array_).bytes().subspan(range.first * stride_, range.count * stride_);
  }
  /// Gives the leaf's pages back; what they hold stays.
  void release(std::uint64_t leaf) const {
    const formats::IndexRange range = range_of(leaf);
    array_.release(range.first * stride_, range.count * stride_);
  }

  /// Tight boxes of all leaves. Reads every record, side by side; throws Stopped.
  std::vector<formats::GridBox> boxes(const Context& context) const;

 private:
  formats::ExternalArray& array_;
  std::size_t stride_;
  const formats::Tree& tree_;
};

/// The grid position that a record begins with.
formats::GridPoint position_of(const std::byte* record);

}  // namespace cairn::stages
