#include "stages/split/partition.h"

#include <algorithm>
#include <type_traits>

#include "formats/vector_path.h"
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

/// Tells the child of each point of a node. Points at a boundary are divided by their order of arrival.
class Divider {
 public:
  /// Instead of a child: the key is that of a boundary.
  static constexpr std::uint32_t kTied = UINT32_MAX;

  Divider(const std::vector<Boundary>& boundaries, std::span<const std::uint64_t> starts)
      : boundaries_(boundaries), starts_(starts) {}

  std::size_t children() const { return starts_.size() - 1; }
  std::span<const Boundary> boundaries() const { return boundaries_; }

  /// For each key of a block its child, before which as many boundaries lie below it, or kTied.
  void find_children(std::span<const std::uint32_t> keys, BlockKeys& child) const {
    child.fill(0);
    for (const Boundary& boundary : boundaries_) {
      const std::uint32_t at = boundary.key;
#pragma omp simd
      for (std::size_t i = 0; i < keys.size(); ++i) child[i] += at < keys[i] ? 1U : 0U;
    }
    for (const Boundary& boundary : boundaries_) {
      const std::uint32_t at = boundary.key;
#pragma omp simd
      for (std::size_t i = 0; i < keys.size(); ++i) child[i] = at == keys[i] ? kTied : child[i];
    }
  }
  /// The first boundary with this key.
  std::size_t boundary_of(std::uint32_t key) const {
    std::size_t i = 0;
    while (boundaries_[i].key != key) ++i;
    return i;
  }
  /// The child of the `arrival`-th point at a boundary.
  std::size_t child_of_tied(std::size_t boundary, std::uint64_t arrival) const {
    const std::uint64_t rank = boundaries_[boundary].less + arrival;
    return static_cast<std::size_t>(std::upper_bound(starts_.begin() + 1, starts_.end() - 1, rank) -
                                    starts_.begin()) -
           1;
  }
  /// How many of the points at a boundary with arrivals in [from, to) go to a child.
  std::uint64_t share_of_tied(std::size_t boundary, std::uint64_t from, std::uint64_t to,
                              std::size_t child) const {
    const std::uint64_t less = boundaries_[boundary].less;
    const std::uint64_t first = std::max(less + from, starts_[child]);
    const std::uint64_t last = std::min(less + to, starts_[child + 1]);
    return last > first ? last - first : 0;
  }

 private:
  const std::vector<Boundary>& boundaries_;
  std::span<const std::uint64_t> starts_;
};

/// Where a slab's next record for each child goes, and how many points at each boundary came before.
struct Cursors {
  std::vector<std::uint64_t> next;     ///< a child
  std::vector<std::uint64_t> arrived;  ///< a boundary; those of equal keys count at the first
};

struct Pass {
  std::span<const Slab> slabs;
  const std::array<double, 3>& step;
  std::size_t axis;
  std::int32_t low;
  const Divider& divider;
  const PartitionTarget& target;
  const PassMode& mode;
};

/// What a slab sends to a child, apart from points at boundaries.
std::uint64_t untied(const std::vector<Boundary>& of_slab, std::uint64_t slab_count,
                     std::size_t child) {
  const std::uint64_t before = child == 0 ? 0 : of_slab[child - 1].less + of_slab[child - 1].equal;
  const std::uint64_t until = child == of_slab.size() ? slab_count : of_slab[child].less;
  return until > before ? until - before : 0;  // less where both boundaries have one key
}

/// Each slab's first cursors, in slab order.
std::vector<Cursors> first_cursors(const Pass& pass, std::span<const std::uint64_t> starts,
                                   const std::vector<std::vector<Boundary>>& of_slabs) {
  const auto boundaries = pass.divider.boundaries();
  Cursors at{std::vector<std::uint64_t>(starts.begin(), starts.end() - 1),
             std::vector<std::uint64_t>(boundaries.size())};
  std::vector<Cursors> cursors;
  for (std::size_t slab = 0; slab < of_slabs.size(); ++slab) {
    cursors.push_back(at);
    for (std::size_t child = 0; child < pass.divider.children(); ++child)
      at.next[child] += untied(of_slabs[slab], pass.slabs[slab].count, child);
    for (std::size_t b = 0; b < boundaries.size(); ++b) {
      if (b > 0 && boundaries[b].key == boundaries[b - 1].key) continue;
      const std::uint64_t from = at.arrived[b], to = from + of_slabs[slab][b].equal;
      for (std::size_t child = 0; child < pass.divider.children(); ++child)
        at.next[child] += pass.divider.share_of_tied(b, from, to, child);
      at.arrived[b] = to;
    }
  }
  return cursors;
}

/// Copies `size_bytes`, of which `words` (constant or not) words of 8 bytes are the least that hold them; at least one word.
template <typename Words>
void copy_words(std::byte* to, const std::byte* from, std::size_t size_bytes, Words words) {
  std::uint64_t word;
  for (std::size_t i = 0; i + 1 < words; ++i) {
    std::memcpy(&word, from + 8 * i, 8);
    std::memcpy(to + 8 * i, &word, 8);
  }
  std::memcpy(&word, from + size_bytes - 8, 8);
  std::memcpy(to + size_bytes - 8, &word, 8);
}

/// Calls visit(copy), where copy(to, from) copies `size_bytes` in words: records are short and memcpy of unknown length is
/// not.
template <typename Visit>
void with_copy(std::size_t size_bytes, const Visit& visit) {
  const std::size_t words = (size_bytes + 7) / 8;
  const auto copy_of = [&](auto count) {
    visit([size_bytes, count](std::byte* to, const std::byte* from) {
      copy_words(to, from, size_bytes, count);
    });
  };
  switch (size_bytes < 8 ? 0 : words) {
    case 0:
      return visit([size_bytes](std::byte* to, const std::byte* from) {
        for (std::size_t i = 0; i < size_bytes; ++i) to[i] = from[i];
      });
    case 1:
      return copy_of(std::integral_constant<std::size_t, 1>{});
    case 2:
      return copy_of(std::integral_constant<std::size_t, 2>{});
    case 3:
      return copy_of(std::integral_constant<std::size_t, 3>{});
    case 4:
      return copy_of(std::integral_constant<std::size_t, 4>{});
    default:
      return copy_of(words);
  }
}

void find_children(const Divider& divider, std::span<const std::uint32_t> keys, BlockKeys& child) {
  divider.find_children(keys, child);
}

std::vector<GridBox> scatter_slab(const Pass& pass, const Slab& slab, Cursors& cursors) {
  std::vector<GridBox> boxes(pass.divider.children());
  const std::vector<std::uint64_t> begin = cursors.next;
  std::byte* out = pass.target.array->bytes().data() + pass.target.first_byte;
  const std::size_t stride = pass.target.stride;
  BlockKeys keys, child_of;
  with_copy(stride - 12, [&](const auto& copy_attributes) {
    for_each_block(slab, [&](const RecordBlock& block) {
      load_keys(block, pass.axis, pass.low, keys);
      formats::vectorized<find_children>(
          pass.divider, std::span<const std::uint32_t>(keys).first(block.count), child_of);
      for (std::size_t i = 0; i < block.count; ++i) {
        std::size_t child = child_of[i];
        if (child == Divider::kTied) {
          const std::size_t boundary = pass.divider.boundary_of(keys[i]);
          child = pass.divider.child_of_tied(boundary, cursors.arrived[boundary]++);
        }
        const std::byte* const record = block.records + i * block.stride;
        const GridPoint p = block.position(i);
        std::byte* const to = out + stride * cursors.next[child]++;
        std::memcpy(to, p.data(), 12);
        copy_attributes(to + 12, record + slab.position_bytes);
        boxes[child].add(p);
        if (slab.rounding != nullptr)
          slab.rounding->add(slab.map->rounded_off(record, p), pass.step);
      }
    });
  });
  if (pass.mode.release) {
    for (std::size_t child = 0; child < begin.size(); ++child)
      pass.target.array->release(pass.target.first_byte + begin[child] * stride,
                                 (cursors.next[child] - begin[child]) * stride);
  }
  if (pass.mode.context.progress != nullptr) pass.mode.context.progress->advance(slab.count);
  return boxes;
}

}  // namespace

std::vector<GridBox> partition(std::span<const Slab> slabs, const GridBox& box,
                               const std::array<double, 3>& step,
                               std::span<const std::uint64_t> starts, const PartitionTarget& target,
                               const PassMode& mode) {
  const std::size_t axis = longest_axis(box, step);
  const auto ranks = starts.subspan(1, starts.size() - 2);
  const Selection selection =
      select_ranks(slabs, axis, box.min[axis], box.span(static_cast<int>(axis)), ranks, mode);
  const Divider divider(selection.boundaries, starts);
  const Pass pass{slabs, step, axis, box.min[axis], divider, target, mode};
  std::vector<Cursors> cursors = first_cursors(pass, starts, selection.slabs);
  std::vector<std::vector<GridBox>> parts(slabs.size());
  for_each_slab(slabs, mode,
                [&](std::uint64_t i) { parts[i] = scatter_slab(pass, slabs[i], cursors[i]); });
  std::vector<GridBox> boxes(divider.children());
  for (const auto& part : parts)
    for (std::size_t child = 0; child < boxes.size(); ++child) boxes[child].add(part[child]);
  return boxes;
}

}  // namespace cairn::stages
