#include "stages/split/split.h"

#include <string>
#include <utility>

#include "formats/checksum.h"
#include "formats/schema.h"
#include "stages/parallel.h"
#include "stages/split/partition.h"
#include "stages/unit_state.h"

namespace cairn::stages {

using formats::ExternalArray;
using formats::GridBox;
using formats::IndexRange;
using formats::Level;
using formats::Tree;

namespace {

/// Nodes of fewer records are divided by one worker; siblings then run side by side.
constexpr std::uint64_t kParallelRecords = 1 << 20;

/// A unit is a node that is divided on the disk, or a whole subtree that is split in memory; its number is the node's.
/// This one tells on which level subtrees are split in memory.
constexpr std::uint64_t kMemoryLevelUnit = kStageDone - 1;

/// What a unit leaves: its children, or, of a subtree, itself.
struct Parts {
  std::vector<GridBox> boxes;
  std::vector<std::uint64_t> checksums;  ///< of their records
  std::vector<Rounding> rounding;        ///< of the root: a scan; else empty
};

/// What an earlier run has told of a unit.
std::optional<Parts> recall(const Context& context, std::string_view units, std::uint64_t unit) {
  const auto state = finished_unit(context, units, unit);
  if (!state) return std::nullopt;
  Parts parts;
  StateReader reader(*state);
  reader.get(parts.boxes);
  reader.get(parts.checksums);
  reader.get(parts.rounding);
  return parts;
}

/// Records of consecutive numbers in an array.
struct Place {
  ExternalArray* array = nullptr;
  std::uint64_t first_record = 0;  ///< number of the array's first
};

class Splitter {
 public:
  /// `again`: an earlier run has left work in the arrays. Throws WorkLost where this run cannot go on with it.
  Splitter(const Tree& tree, std::size_t stride, const std::array<double, 3>& step,
           std::string_view units, bool again, Context& context)
      : tree_(tree), stride_(stride), step_(step), units_(units), again_(again), context_(context) {
    memory_level_ = choose_memory_level();
  }

  /// Whether leaves end in the array that holds the nodes of level 2, and not in that of level 1.
  bool ends_in_second() const {
    if (tree_.leaf_level() == 0) return false;
    const bool changes_sides = memory_level_ < tree_.leaf_level();
    return (memory_level_ % 2 == 0) != changes_sides;
  }

  bool is_done() const { return again_ && finished_unit(context_, units_, kStageDone); }
  void finish() const { finish_unit(context_, units_, kStageDone, {}); }

  /// Whether all records of a split that is done are still there.
  bool is_intact(ExternalArray& array) const {
    const bool in_memory = memory_level_ < tree_.leaf_level();
    const Level level = in_memory ? memory_level_ : std::max<Level>(1, tree_.leaf_level()) - 1;
    for (std::uint64_t index = 0; index < tree_.nodes_on(level); ++index) {
      const auto parts = recalled(unit_of(level, index));
      const auto ranges =
          in_memory ? std::vector{tree_.input_range(level, index)} : child_ranges(level, index);
      if (!parts || !intact(array, ranges, parts->checksums)) return false;
    }
    return true;
  }

  /// Maps the imported records to the grid and divides the root into `to`. A tree of one leaf is just mapped.
  Parts split_root(ImportedPoints& imported, ExternalArray& to) const {
    const IndexRange all = tree_.input_range(0, 0);
    if (auto known = recalled(0)) {
      if (tree_.leaf_level() > 0 || intact(to, {all}, known->checksums)) {
        context_.progress->advance(all.count);
        return std::move(*known);
      }
    }
    if (imported.array.size_bytes() == 0) throw WorkLost{};
    std::vector<Slab> slabs;
    std::vector<std::size_t> scans;  // of the slabs
    const std::uint64_t records = slab_records(imported.stride);
    const auto map_of = [&](std::size_t scan) {
      return imported.maps.empty() || imported.maps[scan].same() ? nullptr : &imported.maps[scan];
    };
    for (const RecordRun& run : imported.runs)
      for (std::uint64_t done = 0; done < run.count; done += records) {
        slabs.push_back({&imported.array, run.first_byte + done * imported.stride,
                         std::min(records, run.count - done), imported.stride,
                         imported.native_position_bytes, map_of(run.scan)});
        scans.push_back(run.scan);
      }
    std::vector<Rounding> of_slabs(slabs.size());
    for (std::size_t i = 0; i < slabs.size(); ++i)
      if (slabs[i].map != nullptr && !slabs[i].map->exact()) slabs[i].rounding = &of_slabs[i];
    Parts parts = divide_and_sum(0, 0, slabs, imported.box, to);
    parts.rounding.resize(imported.maps.size());
    for (std::size_t i = 0; i < slabs.size(); ++i)
      if (slabs[i].map != nullptr) parts.rounding[scans[i]].add(of_slabs[i]);
    remember(0, parts);
    return parts;
  }

  /// Splits the children of a node, whose records stand in `from`.
  void split_children(Level level, std::uint64_t index, const Parts& children, ExternalArray& from,
                      ExternalArray& to) const {
    const auto child = [&](std::uint64_t i) {
      split_below(level + 1, index * tree_.fanout() + i, children.boxes[i], children.checksums[i],
                  from, to);
    };
    if (fits(tree_.input_range(level, index).count))
      return for_each_piece(children.boxes.size(), child);
    for (std::uint64_t i = 0; i < children.boxes.size(); ++i) child(i);
  }

 private:
  /// The first level below the root whose nodes fit in memory; where none does, that of the leaves.
  Level choose_memory_level() const {
    Level level = std::min<Level>(1, tree_.leaf_level());
    while (level < tree_.leaf_level() && !fits(tree_.input_range(level, 0).count)) ++level;
    if (const auto state = finished_unit(context_, units_, kMemoryLevelUnit); again_ && state) {
      Level before = 0;
      StateReader(*state).get(before);
      if (before < level) throw WorkLost{};  // there is less memory than there was
      return before;
    }
    finish_unit(context_, units_, kMemoryLevelUnit, StateWriter().put(level).bytes());
    return level;
  }

  std::optional<Parts> recalled(std::uint64_t unit) const {
    return again_ ? recall(context_, units_, unit) : std::nullopt;
  }

  void remember(std::uint64_t unit, const Parts& parts) const {
    finish_unit(context_, units_, unit,
                StateWriter().put(parts.boxes).put(parts.checksums).put(parts.rounding).bytes());
  }

  std::uint64_t unit_of(Level level, std::uint64_t index) const {
    return formats::value_of(tree_.id(level, index));
  }

  /// Splits a node below the root, whose records stand in `from`.
  void split_below(Level level, std::uint64_t index, const GridBox& box, std::uint64_t checksum,
                   ExternalArray& from, ExternalArray& to) const {
    if (level == tree_.leaf_level()) return;
    throw_if_stopped(context_);
    if (level >= memory_level_) return split_subtree(level, index, box, checksum, from, to);
    const std::vector<IndexRange> ranges = child_ranges(level, index);
    auto children = recalled(unit_of(level, index));
    // Of children that are divided themselves only those are looked at that have not been yet, one by one.
    if (children && level + 1 == tree_.leaf_level() && !intact(to, ranges, children->checksums))
      children.reset();
    if (children) {
      context_.progress->advance(tree_.input_range(level, index).count);
    } else {
      require_source(level, index, checksum, from);
      children = divide_and_sum(level, index, slabs_of({&from, 0}, level, index), box, to);
      remember(unit_of(level, index), *children);
    }
    split_children(level, index, *children, to, from);
  }

  Parts divide_and_sum(Level level, std::uint64_t index, const std::vector<Slab>& slabs,
                       const GridBox& box, ExternalArray& to) const {
    Parts parts;
    parts.boxes = divide(level, index, slabs, box, {&to, 0});
    parts.checksums = checksums_of(to, child_ranges(level, index));
    return parts;
  }

  /// Splits the subtree below a node of the memory level as one unit: from `from` to `to`, and in memory between.
  void split_subtree(Level level, std::uint64_t index, const GridBox& box, std::uint64_t checksum,
                     ExternalArray& from, ExternalArray& to) const {
    const IndexRange range = tree_.input_range(level, index);
    const auto known = recalled(unit_of(level, index));
    if (known && intact(to, {range}, known->checksums)) {
      context_.progress->advance(range.count * (tree_.leaf_level() - level));
      return;
    }
    require_source(level, index, checksum, from);
    ExternalArray between;
    if (tree_.leaf_level() - level > 1) between = ExternalArray::in_memory(range.count * stride_);
    const Place places[] = {{&to, 0}, {&between, range.first}};
    const auto boxes =
        divide(level, index, slabs_of({&from, 0}, level, index), box, target(level, places));
    if (!fits(tree_.points())) from.release(range.first * stride_, range.count * stride_);
    split_in_memory(level, index, boxes, places);
    remember(unit_of(level, index), {{box}, checksums_of(to, {range}), {}});
  }

  /// The leaves' place is the first; the levels above change sides.
  Place target(Level level, std::span<const Place, 2> places) const {
    return places[(tree_.leaf_level() - 1 - level) % 2];
  }

  /// Splits the children of a node, whose boxes these are.
  void split_in_memory(Level level, std::uint64_t index, const std::vector<GridBox>& boxes,
                       std::span<const Place, 2> places) const {
    if (level + 1 == tree_.leaf_level()) return;
    for_each_piece(boxes.size(), [&](std::uint64_t i) {
      throw_if_stopped(context_);
      const std::uint64_t child = index * tree_.fanout() + i;
      const std::vector<Slab> slabs = slabs_of(target(level, places), level + 1, child);
      split_in_memory(level + 1, child,
                      divide(level + 1, child, slabs, boxes[i], target(level + 1, places)), places);
    });
  }

  std::vector<Slab> slabs_of(const Place& place, Level level, std::uint64_t index) const {
    const IndexRange range = tree_.input_range(level, index);
    const std::uint64_t records = slab_records(stride_);
    std::vector<Slab> slabs;
    for (std::uint64_t done = 0; done < range.count; done += records)
      slabs.push_back({place.array, (range.first - place.first_record + done) * stride_,
                       std::min(records, range.count - done), stride_});
    return slabs;
  }

  /// Where the children of a node stand; a leaf, which may be the root, is its only child.
  std::vector<IndexRange> child_ranges(Level level, std::uint64_t index) const {
    if (level == tree_.leaf_level()) return {tree_.input_range(level, index)};
    std::vector<IndexRange> ranges;
    for (std::uint64_t i = 0; i < tree_.fanout(); ++i)
      ranges.push_back(tree_.input_range(level + 1, index * tree_.fanout() + i));
    return ranges;
  }

  std::vector<GridBox> divide(Level level, std::uint64_t index, const std::vector<Slab>& slabs,
                              const GridBox& box, const Place& to) const {
    const IndexRange range = tree_.input_range(level, index);
    std::vector<std::uint64_t> starts;  // ranks at which children begin, and the number of records
    for (const IndexRange& child : child_ranges(level, index))
      starts.push_back(child.first - range.first);
    starts.push_back(range.count);
    const PassMode mode{.context = context_,
                        .parallel = range.count >= kParallelRecords,
                        .release = !fits(range.count)};
    return partition(slabs, box, step_, starts,
                     {to.array, (range.first - to.first_record) * stride_, stride_}, mode);
  }

  std::vector<std::uint64_t> checksums_of(ExternalArray& array,
                                          const std::vector<IndexRange>& ranges) const {
    std::vector<std::uint64_t> checksums(ranges.size());
    for_each_piece(ranges.size(),
                   [&](std::uint64_t i) { checksums[i] = checksum_of(array, ranges[i]); });
    return checksums;
  }

  /// Of stretches of records, each given back if all together would not fit.
  std::uint64_t checksum_of(ExternalArray& array, const IndexRange& range) const {
    formats::RunningChecksum checksum;
    for (std::uint64_t done = 0; done < range.count; done += slab_records(stride_)) {
      throw_if_stopped(context_);
      const std::uint64_t at = (range.first + done) * stride_;
      const std::uint64_t size_bytes =
          std::min(slab_records(stride_), range.count - done) * stride_;
      checksum.add(array.bytes().subspan(at, size_bytes));
      if (!fits(tree_.points())) array.release(at, size_bytes);
    }
    return checksum.value();
  }

  bool intact(ExternalArray& array, const std::vector<IndexRange>& ranges,
              const std::vector<std::uint64_t>& checksums) const {
    return checksums_of(array, ranges) == checksums;
  }

  void require_source(Level level, std::uint64_t index, std::uint64_t checksum,
                      ExternalArray& from) const {
    if (again_ && checksum_of(from, tree_.input_range(level, index)) != checksum) throw WorkLost{};
  }

  /// Both copies of a node's records, source and target, within half of the memory; with what stands in memory between
  /// two passes that is three quarters at most.
  bool fits(std::uint64_t records) const {
    return records * stride_ * 2 <= context_.memory_bytes / 2;
  }

  const Tree& tree_;
  std::size_t stride_;
  std::array<double, 3> step_;
  std::string_view units_;
  bool again_;
  Level memory_level_;
  Context& context_;
};

}  // namespace

std::vector<Rounding> rounding_of_split(const Context& context, std::string_view name) {
  auto root = recall(context, name, 0);
  if (!root) throw WorkLost{};
  return std::move(root->rounding);
}

SplitPoints split(ImportedPoints&& imported, const Tree& tree, Context& context,
                  std::string_view name) {
  const std::size_t stride = imported.stride - imported.native_position_bytes + 12;
  const std::uint64_t size_bytes = imported.points * stride;
  const Level levels = tree.leaf_level();
  const std::string first_name = std::string(name) + "-a", second_name = std::string(name) + "-b";
  auto first = find_array(context, first_name, size_bytes);
  auto second = find_array(context, second_name, size_bytes);
  const Splitter splitter(tree, stride, imported.grid.step, name, first || second, context);
  auto& last = splitter.ends_in_second() ? second : first;
  auto& other = splitter.ends_in_second() ? first : second;
  context.progress->begin(name, imported.points * std::max<Level>(1, levels));
  // A worker holds the slab that it reads and what it writes of it.
  std::vector<Rounding> rounding;
  run_in_arena(workers_within(context, 2 * kSlabBytes), [&] {
    if (splitter.is_done()) {
      if (!last || !splitter.is_intact(*last)) throw WorkLost{};
      rounding = rounding_of_split(context, name);
      return;
    }
    if (second && !first) throw WorkLost{};
    if (!first) first = context.make_array(first_name, size_bytes);
    const Parts children = splitter.split_root(imported, *first);
    rounding = children.rounding;
    imported.array.remove();
    if (levels > 1) {
      if (!second) second = context.make_array(second_name, size_bytes);
      splitter.split_children(0, 0, children, *first, *second);
    }
    splitter.finish();
  });
  context.progress->end();
  if (other) other->remove();
  return {std::move(*last), stride, std::move(rounding)};
}

}  // namespace cairn::stages
