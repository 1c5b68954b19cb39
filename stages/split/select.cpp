#include "stages/split/select.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "formats/error.h"
#include "formats/vector_path.h"

namespace cairn::stages {
namespace {

/// Of the bins of a slab's histogram, all rows together: they stay in the nearest cache. Where there are many slabs they are
/// fewer, so that all histograms together take 16 MiB or so.
constexpr int kHistogramBits = 12;
constexpr int kAllHistogramsBits = 22;

/// A range of keys that share their leading bits and that holds at least one wanted rank.
struct OpenBin {
  std::uint32_t prefix;
  std::uint64_t less;  ///< points before it
  std::uint64_t held;  ///< points in it
};

/// What a slab holds.
struct SlabCounts {
  std::vector<Boundary>
      bins;  ///< for each open one its points, and those before it; the key is left open
  std::vector<std::uint32_t> digits;  ///< of the next digit in each open bin
};

/// The open bins on the way to the ranks.
class Narrowing {
 public:
  Narrowing(std::span<const Slab> slabs, std::size_t axis, std::int32_t low, std::uint32_t span,
            std::span<const std::uint64_t> ranks, const PassMode& mode)
      : slabs_(slabs), axis_(axis), low_(low), ranks_(ranks), mode_(mode), counts_(slabs.size()) {
    std::uint64_t points = 0;
    for (const Slab& slab : slabs) points += slab.count;
    open_.push_back({0, 0, points});
    for (std::size_t i = 0; i < slabs.size(); ++i)
      counts_[i].bins.assign(1, {.key = 0, .less = 0, .equal = slabs[i].count});
    bits_left_ = std::max(1, static_cast<int>(std::bit_width(span)));
  }

  bool done() const { return bits_left_ == 0; }
  std::uint64_t held() const {
    std::uint64_t sum = 0;
    for (const OpenBin& bin : open_) sum += bin.held;
    return sum;
  }

  void count_next_digit();
  Selection sort_the_rest() const;

 private:
  /// The open bin that a key lies in, or their number.
  std::size_t row_of(std::uint32_t key) const {
    const std::uint64_t prefix = std::uint64_t{key} >> bits_left_;
    if (open_.size() == 1) return prefix == open_[0].prefix ? 0 : 1;
    const auto at = std::lower_bound(
        open_.begin(), open_.end(), prefix,
        [](const OpenBin& bin, std::uint64_t value) { return bin.prefix < value; });
    return at != open_.end() && at->prefix == prefix ? static_cast<std::size_t>(at - open_.begin())
                                                     : open_.size();
  }

  template <typename Visit>
  void for_each_block_of_keys(const Slab& slab, const Visit& visit) const {
    BlockKeys keys;
    for_each_block(slab, [&](const RecordBlock& block) {
      load_keys(block, axis_, low_, keys);
      visit(std::span<const std::uint32_t>(keys).first(block.count));
    });
  }

  void count(const Slab& slab, int digit_bits, std::vector<std::uint32_t>& digits) const;
  void refine(int digit_bits);
  std::vector<std::vector<std::uint32_t>> collect(const Slab& slab) const;

  const std::span<const Slab> slabs_;
  const std::size_t axis_;
  const std::int32_t low_;
  const std::span<const std::uint64_t> ranks_;
  const PassMode& mode_;
  std::vector<OpenBin> open_;  ///< ascending
  std::vector<SlabCounts> counts_;
  int bits_left_;  ///< of a key that no digit has told yet
};

void Narrowing::count(const Slab& slab, int digit_bits, std::vector<std::uint32_t>& digits) const {
  const std::uint32_t mask = (std::uint32_t{1} << digit_bits) - 1;
  const int shift = bits_left_ - digit_bits;
  digits.assign(open_.size() << digit_bits, 0);
  for_each_block_of_keys(slab, [&](std::span<const std::uint32_t> keys) {
    for (const std::uint32_t key : keys) {
      const auto row = row_of(key);
      if (row < open_.size()) ++digits[(row << digit_bits) + ((key >> shift) & mask)];
    }
  });
}

/// Finds for each rank the bin of the finer histogram that holds it.
void Narrowing::refine(int digit_bits) {
  const std::size_t digits = std::size_t{1} << digit_bits;
  std::vector<std::uint64_t> total(open_.size() * digits);
  for (const SlabCounts& counts : counts_)
    for (std::size_t at = 0; at < total.size(); ++at) total[at] += counts.digits[at];

  std::vector<OpenBin> finer;
  std::vector<std::size_t> places;  // of the finer bins in the histogram
  std::size_t next_rank = 0;
  for (std::size_t row = 0; row < open_.size(); ++row) {
    std::uint64_t less = open_[row].less;
    for (std::size_t at = row * digits; at < (row + 1) * digits; less += total[at++]) {
      if (next_rank == ranks_.size() || ranks_[next_rank] >= less + total[at]) continue;
      const std::uint64_t prefix = (std::uint64_t{open_[row].prefix} << digit_bits) | at % digits;
      finer.push_back({static_cast<std::uint32_t>(prefix), less, total[at]});
      places.push_back(at);
      while (next_rank < ranks_.size() && ranks_[next_rank] < less + total[at]) ++next_rank;
    }
  }
  CAIRN_CHECK(next_rank == ranks_.size());
  open_ = std::move(finer);

  for (SlabCounts& counts : counts_) {
    std::vector<Boundary> bins;
    for (const std::size_t place : places) {
      const auto first =
          counts.digits.begin() + static_cast<std::ptrdiff_t>(place - place % digits);
      const std::uint64_t before = std::accumulate(
          first, counts.digits.begin() + static_cast<std::ptrdiff_t>(place), std::uint64_t{0});
      bins.push_back({.key = 0,
                      .less = counts.bins[place / digits].less + before,
                      .equal = counts.digits[place]});
    }
    counts.bins = std::move(bins);
  }
}

void Narrowing::count_next_digit() {
  const int row_bits = static_cast<int>(std::bit_width(open_.size() - 1));
  const int slab_bits = static_cast<int>(std::bit_width(slabs_.size()));
  const int bits = std::clamp(kAllHistogramsBits - slab_bits, kHistogramBits - 4, kHistogramBits);
  const int digit_bits = std::min(bits_left_, bits - row_bits);
  for_each_slab(slabs_, mode_,
                [&](std::uint64_t i) { count(slabs_[i], digit_bits, counts_[i].digits); });
  refine(digit_bits);
  bits_left_ -= digit_bits;
}

/// Whether each key of a block lies in an open bin: 0 or 1.
using Matches = std::array<std::uint32_t, RecordBlock::kMost>;

void match(std::span<const std::uint32_t> keys, const std::vector<OpenBin>& open, int shift,
           Matches& matches) {
  matches.fill(0);
  for (const OpenBin& bin : open) {
    const std::uint32_t prefix = bin.prefix;
#pragma omp simd
    for (std::size_t i = 0; i < keys.size(); ++i)
      matches[i] |= (keys[i] >> shift) == prefix ? 1U : 0U;
  }
}

/// The keys of a slab in each open bin.
std::vector<std::vector<std::uint32_t>> Narrowing::collect(const Slab& slab) const {
  std::vector<std::vector<std::uint32_t>> collected(open_.size());
  Matches matches;
  for_each_block_of_keys(slab, [&](std::span<const std::uint32_t> keys) {
    formats::vectorized<match>(keys, open_, bits_left_, matches);
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (matches[i] != 0) collected[row_of(keys[i])].push_back(keys[i]);
  });
  return collected;
}

Selection Narrowing::sort_the_rest() const {
  Selection selection{.boundaries = {}, .slabs = std::vector<std::vector<Boundary>>(slabs_.size())};
  // Where no bits are left, all keys in a bin are equal, and the bins are the boundaries.
  std::vector<std::vector<std::vector<std::uint32_t>>> keys_of_slabs(slabs_.size());
  if (!done())
    for_each_slab(slabs_, mode_, [&](std::uint64_t i) { keys_of_slabs[i] = collect(slabs_[i]); });
  const std::vector<std::uint32_t> none;
  std::size_t rank = 0;
  for (std::size_t row = 0; row < open_.size(); ++row) {
    const OpenBin& bin = open_[row];
    std::vector<std::uint32_t> keys;
    for (const auto& of_bins : keys_of_slabs)
      if (!done()) keys.insert(keys.end(), of_bins[row].begin(), of_bins[row].end());
    std::ranges::sort(keys);
    for (; rank < ranks_.size() && ranks_[rank] < bin.less + bin.held; ++rank) {
      const std::uint32_t key = done() ? bin.prefix : keys[ranks_[rank] - bin.less];
      const auto boundary = [&](const Boundary& in_bin, const std::vector<std::uint32_t>& others) {
        if (done()) return Boundary{key, in_bin.less, in_bin.equal};
        const auto less = std::ranges::count_if(others, [&](auto other) { return other < key; });
        return Boundary{key, in_bin.less + static_cast<std::uint64_t>(less),
                        static_cast<std::uint64_t>(std::ranges::count(others, key))};
      };
      selection.boundaries.push_back(boundary({0, bin.less, bin.held}, keys));
      for (std::size_t slab = 0; slab < slabs_.size(); ++slab)
        selection.slabs[slab].push_back(
            boundary(counts_[slab].bins[row], done() ? none : keys_of_slabs[slab][row]));
    }
  }
  return selection;
}

}  // namespace

Selection select_ranks(std::span<const Slab> slabs, std::size_t axis, std::int32_t low,
                       std::uint32_t span, std::span<const std::uint64_t> ranks,
                       const PassMode& mode, std::uint64_t most_collected) {
  if (ranks.empty())
    return {.boundaries = {}, .slabs = std::vector<std::vector<Boundary>>(slabs.size())};
  Narrowing narrowing(slabs, axis, low, span, ranks, mode);
  do narrowing.count_next_digit();
  while (!narrowing.done() && narrowing.held() > most_collected);
  return narrowing.sort_the_rest();
}

}  // namespace cairn::stages
