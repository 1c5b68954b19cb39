#include "stages/split/partition.h"

#include <algorithm>

#include "stages/split/select.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;

namespace {

std::size_t longest_axis(const GridBox& box, const std::array<double, 3>& step) {
  std::size_t longest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis)
    if (box.span(static_cast<int>(axis)) * step[axis] >
        box.span(static_cast<int>(longest)) * step[longest])
      longest = axis;
  return longest;
}

/// A key at which children meet: points of this key are divided by their order of arrival.
struct Tie {
  std::uint32_t key;
  std::uint64_t less;  ///< points of the node with a smaller key
};

/// Tells the child of each point of a node.
class Divider {
 public:
  Divider(std::vector<Tie> ties, std::vector<std::uint32_t> boundary_keys,
          std::span<const std::uint64_t> starts)
      : ties_(std::move(ties)), boundary_keys_(std::move(boundary_keys)), starts_(starts) {}

  std::size_t children() const { return starts_.size() - 1; }
  std::size_t tie_count() const { return ties_.size(); }

  /// The child of a point whose key is no tie: as many boundaries lie below it.
  std::size_t child_of_key(std::uint32_t key) const {
    std::size_t child = 0;
    for (const std::uint32_t boundary : boundary_keys_) child += boundary < key;
    return child;
  }
  /// The tie with this key, or tie_count().
  std::size_t tie_of_key(std::uint32_t key) const {
    std::size_t i = 0;
    while (i < ties_.size() && ties_[i].key != key) ++i;
    return i;
  }
  /// The child of the `arrival`-th point of a tie.
  std::size_t child_of_tie(std::size_t tie, std::uint64_t arrival) const {
    const std::uint64_t rank = ties_[tie].less + arrival;
    return static_cast<std::size_t>(std::upper_bound(starts_.begin() + 1, starts_.end() - 1, rank) -
                                    starts_.begin()) -
           1;
  }
  /// How many points of a tie with arrivals in [from, to) go to a child.
  std::uint64_t tie_share(std::size_t tie, std::uint64_t from, std::uint64_t to,
                          std::size_t child) const {
    const std::uint64_t first = std::max(ties_[tie].less + from, starts_[child]);
    const std::uint64_t last = std::min(ties_[tie].less + to, starts_[child + 1]);
    return last > first ? last - first : 0;
  }

 private:
  std::vector<Tie> ties_;
  std::vector<std::uint32_t> boundary_keys_;
  std::span<const std::uint64_t> starts_;
};

/// Where a slab's next record for each child goes, and how many points of each tie came before.
struct Cursors {
  std::vector<std::uint64_t> next;     ///< a child
  std::vector<std::uint64_t> arrived;  ///< a tie
};

struct Pass {
  std::span<const Slab> slabs;
  const std::array<double, 3>& step;
  std::size_t axis;
  std::int32_t low;
  const Divider& divider;
  const PartitionTarget& target;
  const PassMode& mode;

  std::uint32_t key(const GridPoint& p) const {
    return static_cast<std::uint32_t>(p[axis]) - static_cast<std::uint32_t>(low);
  }
};

/// What a slab will send to each child, ties left out, and how many points of each tie it holds.
Cursors count_slab(const Pass& pass, const Slab& slab) {
  Cursors counts{std::vector<std::uint64_t>(pass.divider.children()),
                 std::vector<std::uint64_t>(pass.divider.tie_count())};
  for_each_record(slab, [&](const std::byte*, const GridPoint& p) {
    const std::uint32_t key = pass.key(p);
    const std::size_t tie = pass.divider.tie_of_key(key);
    if (tie < counts.arrived.size())
      ++counts.arrived[tie];
    else
      ++counts.next[pass.divider.child_of_key(key)];
  });
  return counts;
}

/// Turns the slabs' counts into each slab's first cursors.
void accumulate(const Divider& divider, std::span<const std::uint64_t> starts,
                std::vector<Cursors>& slabs) {
  Cursors at{std::vector<std::uint64_t>(starts.begin(), starts.end() - 1),
             std::vector<std::uint64_t>(divider.tie_count())};
  for (Cursors& slab : slabs) {
    Cursors after = at;
    for (std::size_t child = 0; child < divider.children(); ++child) {
      after.next[child] += slab.next[child];
      for (std::size_t tie = 0; tie < divider.tie_count(); ++tie)
        after.next[child] +=
            divider.tie_share(tie, at.arrived[tie], at.arrived[tie] + slab.arrived[tie], child);
    }
    for (std::size_t tie = 0; tie < divider.tie_count(); ++tie)
      after.arrived[tie] += slab.arrived[tie];
    slab = std::move(at);
    at = std::move(after);
  }
}

/// Copies `size_bytes` >= 8 in words; records are short and memcpy of unknown length is not.
inline void copy_attributes(std::byte* to, const std::byte* from, std::size_t size_bytes) {
  if (size_bytes < 8) {
    for (std::size_t i = 0; i < size_bytes; ++i) to[i] = from[i];
    return;
  }
  std::uint64_t word;
  for (std::size_t i = 0; i + 8 < size_bytes; i += 8) {
    std::memcpy(&word, from + i, 8);
    std::memcpy(to + i, &word, 8);
  }
  std::memcpy(&word, from + size_bytes - 8, 8);
  std::memcpy(to + size_bytes - 8, &word, 8);
}

std::vector<GridBox> scatter_slab(const Pass& pass, const Slab& slab, Cursors& cursors) {
  std::vector<GridBox> boxes(pass.divider.children());
  const std::vector<std::uint64_t> begin = cursors.next;
  std::byte* out = pass.target.array->bytes().data() + pass.target.first_byte;
  const std::size_t stride = pass.target.stride;
  for_each_record(slab, [&](const std::byte* record, const GridPoint& p) {
    const std::uint32_t key = pass.key(p);
    const std::size_t tie = pass.divider.tie_of_key(key);
    const std::size_t child = tie < cursors.arrived.size()
                                  ? pass.divider.child_of_tie(tie, cursors.arrived[tie]++)
                                  : pass.divider.child_of_key(key);
    std::byte* to = out + stride * cursors.next[child]++;
    std::memcpy(to, p.data(), 12);
    copy_attributes(to + 12, record + slab.position_bytes, stride - 12);
    boxes[child].add(p);
    if (slab.rounding != nullptr) slab.rounding->add(slab.map->rounded_off(record, p), pass.step);
  });
  if (pass.mode.release) {
    for (std::size_t child = 0; child < begin.size(); ++child)
      pass.target.array->release(pass.target.first_byte + begin[child] * stride,
                                 (cursors.next[child] - begin[child]) * stride);
  }
  if (pass.mode.context.progress != nullptr) pass.mode.context.progress->advance(slab.count);
  return boxes;
}

std::vector<GridBox> scatter(const Pass& pass, std::span<const std::uint64_t> starts) {
  std::vector<GridBox> boxes(pass.divider.children());
  const auto merge = [&](const std::vector<GridBox>& part) {
    for (std::size_t child = 0; child < boxes.size(); ++child) boxes[child].add(part[child]);
  };
  if (!pass.mode.parallel) {
    // In order, each slab's cursors are simply where the one before has stopped.
    Cursors cursors{{starts.begin(), starts.end() - 1},
                    std::vector<std::uint64_t>(pass.divider.tie_count())};
    for_each_slab(pass.slabs, pass.mode,
                  [&](std::uint64_t i) { merge(scatter_slab(pass, pass.slabs[i], cursors)); });
    return boxes;
  }
  std::vector<Cursors> cursors(pass.slabs.size());
  for_each_slab(pass.slabs, pass.mode,
                [&](std::uint64_t i) { cursors[i] = count_slab(pass, pass.slabs[i]); });
  accumulate(pass.divider, starts, cursors);
  std::vector<std::vector<GridBox>> parts(pass.slabs.size());
  for_each_slab(pass.slabs, pass.mode,
                [&](std::uint64_t i) { parts[i] = scatter_slab(pass, pass.slabs[i], cursors[i]); });
  for (const auto& part : parts) merge(part);
  return boxes;
}

}  // namespace

std::vector<GridBox> partition(std::span<const Slab> slabs, const GridBox& box,
                               const std::array<double, 3>& step,
                               std::span<const std::uint64_t> starts, const PartitionTarget& target,
                               const PassMode& mode) {
  const std::size_t axis = longest_axis(box, step);
  const auto ranks = starts.subspan(1, starts.size() - 2);
  const std::vector<Boundary> boundaries =
      select_ranks(slabs, axis, box.min[axis], box.span(static_cast<int>(axis)), ranks, mode);
  std::vector<Tie> ties;
  std::vector<std::uint32_t> keys;
  for (const Boundary& boundary : boundaries) {
    keys.push_back(boundary.key);
    if (ties.empty() || ties.back().key != boundary.key)
      ties.push_back({boundary.key, boundary.less});
  }
  const Divider divider(std::move(ties), std::move(keys), starts);
  return scatter({slabs, step, axis, box.min[axis], divider, target, mode}, starts);
}

}  // namespace cairn::stages
