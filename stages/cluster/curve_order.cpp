#include "stages/cluster/curve_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "formats/dataset/hilbert.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;
using formats::kHilbertBits;

namespace {

struct Entry {
  std::uint64_t key;
  std::uint32_t index;
};

/// Stable radix sort by the key's 48 bits, 12 at a time; passes that would move nothing are skipped.
void sort_by_key(std::vector<Entry>& entries) {
  constexpr int kDigitBits = 12;
  constexpr std::size_t kBins = std::size_t{1} << kDigitBits;
  constexpr int kPasses = 3 * kHilbertBits / kDigitBits;
  std::vector<std::array<std::uint32_t, kBins>> counts(kPasses);
  for (const Entry& entry : entries)
    for (int pass = 0; pass < kPasses; ++pass)
      ++counts[pass][(entry.key >> (kDigitBits * pass)) % kBins];
  std::vector<Entry> sorted(entries.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    auto& bins = counts[pass];
    if (std::any_of(bins.begin(), bins.end(), [&](std::uint32_t n) { return n == entries.size(); }))
      continue;
    std::uint32_t start = 0;
    for (std::uint32_t& bin : bins) start += std::exchange(bin, start);
    for (const Entry& entry : entries)
      sorted[bins[(entry.key >> (kDigitBits * pass)) % kBins]++] = entry;
    entries.swap(sorted);
  }
}

}  // namespace

CurveOrder order_along_curve(const formats::Grid& grid, std::span<const GridPoint> points,
                             std::optional<std::uint32_t> cells) {
  const GridBox box = formats::box_of(points);
  double extent = 0;
  for (int axis = 0; axis < 3; ++axis)
    extent = std::max(extent, grid.step[axis] * (box.span(axis) + 1.0));

  CurveOrder result;
  result.cell_bits = cells ? std::bit_width(*cells - 1) : kHilbertBits;
  const std::uint32_t lattice =
      cells ? *cells << (kHilbertBits - result.cell_bits) : std::uint32_t{1} << kHilbertBits;
  result.cells_per_unit = lattice / extent;
  std::array<double, 3> scale;
  for (int axis = 0; axis < 3; ++axis) scale[axis] = grid.step[axis] * result.cells_per_unit;

  std::vector<Entry> entries(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::array<std::uint16_t, 3> cell;
    for (int axis = 0; axis < 3; ++axis) {
      const auto above =
          static_cast<std::uint32_t>(points[i][axis]) - static_cast<std::uint32_t>(box.min[axis]);
      cell[axis] = static_cast<std::uint16_t>(
          std::min(static_cast<std::uint32_t>(above * scale[axis]), lattice - 1));
    }
    entries[i] = {formats::hilbert_key(cell[0], cell[1], cell[2]), i};
  }
  sort_by_key(entries);
  result.order.reserve(points.size());
  result.key.reserve(points.size());
  for (const Entry& entry : entries) {
    result.order.push_back(entry.index);
    result.key.push_back(entry.key);
  }
  return result;
}

}  // namespace cairn::stages
