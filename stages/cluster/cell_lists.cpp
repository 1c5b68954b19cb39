#include "stages/cluster/cell_lists.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "formats/dataset/hilbert.h"
#include "formats/error.h"

namespace cairn::stages {

using formats::kHilbertBits;

int auto_cell_bits(std::span<const std::uint64_t> keys) {
  // Neighbours on the curve part at some bit: below it they share a cell, from it on they do not.
  std::array<std::uint64_t, kHilbertBits + 1> parted_at{};
  for (std::size_t i = 1; i < keys.size(); ++i) {
    const std::uint64_t difference = keys[i] ^ keys[i - 1];
    if (difference == 0) continue;
    const int highest = std::bit_width(difference) - 1;
    ++parted_at[static_cast<std::size_t>(kHilbertBits - highest / 3)];
  }
  int best = 0;
  double best_ratio = INFINITY;
  std::uint64_t occupied = 1;
  for (int bits = 0; bits <= kHilbertBits; ++bits) {
    occupied += parted_at[static_cast<std::size_t>(bits)];
    const double points = static_cast<double>(keys.size()) / static_cast<double>(occupied);
    const double ratio = std::max(points / kAutoCellPoints, kAutoCellPoints / points);
    if (ratio < best_ratio) {
      best = bits;
      best_ratio = ratio;
    }
  }
  return best;
}

std::vector<std::uint32_t> cut_lists(std::span<const std::uint64_t> keys, int cell_bits,
                                     std::uint32_t longest) {
  CAIRN_CHECK(longest >= 1 && longest <= kMaxListLength);
  const int shift = 3 * (kHilbertBits - cell_bits);
  const auto size = static_cast<std::uint32_t>(keys.size());
  std::vector<std::uint32_t> starts;
  for (std::uint32_t first = 0; first < size;) {
    std::uint32_t last = first + 1;
    while (last < size && keys[last] >> shift == keys[first] >> shift) ++last;
    const std::uint64_t count = last - first, parts = (count + longest - 1) / longest;
    for (std::uint64_t part = 0; part < parts; ++part)
      starts.push_back(first + static_cast<std::uint32_t>(part * count / parts));
    first = last;
  }
  starts.push_back(size);
  return starts;
}

std::uint32_t leveled_length(std::span<const std::uint32_t> lengths, std::uint64_t quota) {
  std::array<std::uint64_t, kMaxListLength + 1> lists_of{};  // by length
  std::uint64_t total = 0;
  for (const std::uint32_t length : lengths) {
    CAIRN_CHECK(length >= 1 && length <= kMaxListLength);
    ++lists_of[length];
    total += length;
  }
  CAIRN_CHECK(quota <= total);
  // Lower the ceiling while a whole step still leaves enough; `cut` lists stand at the ceiling.
  std::uint32_t ceiling = kMaxListLength;
  std::uint64_t cut = lists_of[ceiling];
  while (ceiling > 1 && total - quota >= cut) {
    total -= cut;
    --ceiling;
    cut += lists_of[ceiling];
  }
  return ceiling;
}

}  // namespace cairn::stages
