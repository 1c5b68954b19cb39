#include "stages/split/split.h"

#include <utility>

#include "formats/schema.h"
#include "stages/parallel.h"
#include "stages/split/partition.h"

namespace cairn::stages {

using formats::ExternalArray;
using formats::GridBox;
using formats::IndexRange;
using formats::Level;
using formats::Tree;

namespace {

/// Nodes of fewer records are divided by one worker; siblings then run side by side.
constexpr std::uint64_t kParallelRecords = 1 << 20;

class Splitter {
 public:
  Splitter(const Tree& tree, std::size_t stride, const std::array<double, 3>& step,
           Context& context)
      : tree_(tree), stride_(stride), step_(step), context_(context) {}

  /// Maps the imported records to the grid and divides the root. A tree of one leaf is just mapped.
  std::vector<GridBox> split_root(ImportedPoints& imported, ExternalArray& to) const {
    std::vector<Slab> slabs;
    const std::uint64_t records = slab_records(imported.stride);
    for (const RecordRun& run : imported.runs)
      for (std::uint64_t done = 0; done < run.count; done += records)
        slabs.push_back({&imported.array, run.first_byte + done * imported.stride,
                         std::min(records, run.count - done), imported.stride,
                         imported.native_position_bytes, &imported.maps[run.scan]});
    return divide(slabs, imported.box, starts_of_children(0, 0), to, 0);
  }

  /// Divides a node below the root, whose records stand in `from`, and all nodes below it. Its children
  /// stand in `to`, theirs in `from` again: all leaves end in the same array.
  void split_below(Level level, std::uint64_t index, const GridBox& box, ExternalArray& from,
                   ExternalArray& to) const {
    if (level == tree_.leaf_level()) return;
    throw_if_stopped(context_);
    const IndexRange range = tree_.input_range(level, index);
    std::vector<Slab> slabs;
    const std::uint64_t records = slab_records(stride_);
    for (std::uint64_t done = 0; done < range.count; done += records)
      slabs.push_back(
          {&from, (range.first + done) * stride_, std::min(records, range.count - done), stride_});
    const auto boxes = divide(slabs, box, starts_of_children(level, index), to, range.first);
    split_children(level, index, boxes, to, from);
  }

  void split_children(Level level, std::uint64_t index, const std::vector<GridBox>& boxes,
                      ExternalArray& from, ExternalArray& to) const {
    const std::uint64_t first = index * tree_.fanout();
    const auto child = [&](std::uint64_t i) {
      split_below(level + 1, first + i, boxes[i], from, to);
      const IndexRange range = tree_.input_range(level + 1, first + i);
      // The top node that fits in memory is done with: its pages make room for the next.
      if (!fits(tree_.input_range(level, index).count) && fits(range.count)) {
        from.release(range.first * stride_, range.count * stride_);
        to.release(range.first * stride_, range.count * stride_);
      }
    };
    if (fits(tree_.input_range(level, index).count)) return for_each_piece(boxes.size(), child);
    for (std::uint64_t i = 0; i < boxes.size(); ++i) child(i);
  }

 private:
  /// Ranks at which the children of a node begin, and the number of its records.
  std::vector<std::uint64_t> starts_of_children(Level level, std::uint64_t index) const {
    const IndexRange range = tree_.input_range(level, index);
    std::vector<std::uint64_t> starts;
    if (level == tree_.leaf_level()) return {0, range.count};
    for (std::uint64_t i = 0; i < tree_.fanout(); ++i)
      starts.push_back(tree_.input_range(level + 1, index * tree_.fanout() + i).first -
                       range.first);
    starts.push_back(range.count);
    return starts;
  }

  std::vector<GridBox> divide(const std::vector<Slab>& slabs, const GridBox& box,
                              const std::vector<std::uint64_t>& starts, ExternalArray& to,
                              std::uint64_t first_record) const {
    const std::uint64_t count = starts.back();
    const PassMode mode{
        .context = context_, .parallel = count >= kParallelRecords, .release = !fits(count)};
    return partition(slabs, box, step_, starts, {&to, first_record * stride_, stride_}, mode);
  }

  /// Both copies of a node's records, source and target, within half of the memory.
  bool fits(std::uint64_t records) const {
    return records * stride_ * 2 <= context_.memory_bytes / 2;
  }

  const Tree& tree_;
  std::size_t stride_;
  std::array<double, 3> step_;
  Context& context_;
};

}  // namespace

SplitPoints split(ImportedPoints&& imported, const Tree& tree, Context& context) {
  const std::size_t stride = imported.stride - imported.native_position_bytes + 12;
  const Level levels = tree.leaf_level();
  context.progress->begin("split", imported.points * std::max<Level>(1, levels));
  ExternalArray first = context.make_array("split-a", imported.points * stride);
  const Splitter splitter(tree, stride, imported.grid.step, context);
  ExternalArray second;
  // A worker holds the slab that it reads and what it writes of it.
  run_in_arena(workers_within(context, 2 * kSlabBytes), [&] {
    const std::vector<GridBox> boxes = splitter.split_root(imported, first);
    imported.array = ExternalArray{};
    if (levels > 1) second = context.make_array("split-b", imported.points * stride);
    if (levels > 0) splitter.split_children(0, 0, boxes, first, second);
  });
  context.progress->end();
  // The root pass fills `first`; every further level changes sides.
  return {levels > 1 && levels % 2 == 0 ? std::move(second) : std::move(first), stride};
}

}  // namespace cairn::stages
