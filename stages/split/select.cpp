#include "stages/split/select.h"

#include <algorithm>
#include <bit>

#include <tbb/enumerable_thread_specific.h>

#include "formats/error.h"

namespace cairn::stages {
namespace {

using Counts = std::vector<std::uint64_t>;

/// A bin of the passes so far that holds at least one wanted rank.
struct OpenBin {
  std::uint32_t prefix;  ///< leading bits of its keys
  std::uint64_t less;    ///< points before it
};

/// Counts the next `digit_bits` of all keys that lie in an open bin: one row of 2^digit_bits a bin.
class DigitCounter {
 public:
  DigitCounter(const std::vector<OpenBin>& open, int bits_left, int digit_bits)
      : open_(open),
        prefix_shift_(bits_left),
        digit_shift_(bits_left - digit_bits),
        digit_bits_(digit_bits) {}

  void count(const Slab& slab, std::size_t axis, std::int32_t low, Counts& counts) const {
    const std::uint32_t mask = (std::uint32_t{1} << digit_bits_) - 1;
    for_each_record(slab, [&](const std::byte*, const formats::GridPoint& p) {
      const std::uint32_t key =
          static_cast<std::uint32_t>(p[axis]) - static_cast<std::uint32_t>(low);
      const auto row = row_of(key);
      if (row < open_.size()) ++counts[(row << digit_bits_) + ((key >> digit_shift_) & mask)];
    });
  }
  std::size_t size() const { return open_.size() << digit_bits_; }

 private:
  /// The open bin that a key lies in, or open_.size().
  std::size_t row_of(std::uint32_t key) const {
    const std::uint64_t prefix = std::uint64_t{key} >> prefix_shift_;
    if (open_.size() == 1) return prefix == open_[0].prefix ? 0 : 1;
    const auto at = std::lower_bound(
        open_.begin(), open_.end(), prefix,
        [](const OpenBin& bin, std::uint64_t value) { return bin.prefix < value; });
    return at != open_.end() && at->prefix == prefix ? static_cast<std::size_t>(at - open_.begin())
                                                     : open_.size();
  }

  const std::vector<OpenBin>& open_;
  int prefix_shift_;
  int digit_shift_;
  int digit_bits_;
};

Counts count_all(std::span<const Slab> slabs, const DigitCounter& counter, std::size_t axis,
                 std::int32_t low, const PassMode& mode) {
  Counts total(counter.size());
  if (!mode.parallel) {
    for_each_slab(slabs, mode, [&](std::uint64_t i) { counter.count(slabs[i], axis, low, total); });
    return total;
  }
  tbb::enumerable_thread_specific<Counts> partial(total);
  for_each_slab(slabs, mode,
                [&](std::uint64_t i) { counter.count(slabs[i], axis, low, partial.local()); });
  for (const Counts& counts : partial)
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += counts[i];
  return total;
}

/// Finds for each rank the bin of the finer histogram that holds it.
std::vector<OpenBin> refine(const std::vector<OpenBin>& open, const Counts& counts, int digit_bits,
                            std::span<const std::uint64_t> ranks) {
  std::vector<OpenBin> finer;
  std::size_t next_rank = 0;
  for (std::size_t row = 0; row < open.size(); ++row) {
    std::uint64_t less = open[row].less;
    for (std::size_t digit = 0; digit < (std::size_t{1} << digit_bits); ++digit) {
      const std::uint64_t here = counts[(row << digit_bits) + digit];
      if (next_rank < ranks.size() && ranks[next_rank] < less + here) {
        finer.push_back(
            {static_cast<std::uint32_t>((std::uint64_t{open[row].prefix} << digit_bits) | digit),
             less});
        while (next_rank < ranks.size() && ranks[next_rank] < less + here) ++next_rank;
      }
      less += here;
    }
  }
  CAIRN_CHECK(next_rank == ranks.size());
  return finer;
}

std::uint64_t total_count(std::span<const Slab> slabs) {
  std::uint64_t total = 0;
  for (const Slab& slab : slabs) total += slab.count;
  return total;
}

}  // namespace

std::vector<Boundary> select_ranks(std::span<const Slab> slabs, std::size_t axis, std::int32_t low,
                                   std::uint32_t span, std::span<const std::uint64_t> ranks,
                                   const PassMode& mode) {
  if (ranks.empty()) return {};
  // The first digit is as wide as pays for the node's size: with 16 bits most real nodes need one pass.
  const int widest = std::clamp(static_cast<int>(std::bit_width(total_count(slabs))) - 2, 8, 16);
  std::vector<OpenBin> open{{0, 0}};
  int bits_left = std::max(1, static_cast<int>(std::bit_width(span)));
  int digit_bits = std::min(bits_left, widest);
  while (bits_left > 0) {
    const DigitCounter counter(open, bits_left, digit_bits);
    open = refine(open, count_all(slabs, counter, axis, low, mode), digit_bits, ranks);
    bits_left -= digit_bits;
    digit_bits = std::min(bits_left, 12);
  }
  std::vector<Boundary> boundaries;
  std::size_t bin = 0;
  for (const std::uint64_t rank : ranks) {
    while (bin + 1 < open.size() && open[bin + 1].less <= rank) ++bin;
    boundaries.push_back({open[bin].prefix, open[bin].less});
  }
  return boundaries;
}

}  // namespace cairn::stages
