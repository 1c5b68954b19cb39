#include "stages/neighbors/distinct_positions.h"

#include <algorithm>

#include "formats/dataset/hilbert.h"
#include "stages/neighbors/leaf_records.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;

namespace {

/// Key of the cell of a position, on the lattice that 16 bits an axis span over the box.
std::uint64_t curve_key(const GridPoint& p, const GridBox& box) {
  std::array<std::uint16_t, 3> cell;
  int shift = 0;
  for (int axis = 0; axis < 3; ++axis)
    while (box.span(axis) >> shift > UINT16_MAX) ++shift;
  for (std::size_t axis = 0; axis < 3; ++axis)
    cell[axis] = static_cast<std::uint16_t>(
        static_cast<std::uint64_t>(std::int64_t{p[axis]} - box.min[axis]) >> shift);
  return formats::hilbert_key(cell[0], cell[1], cell[2]);
}

struct Keyed {
  std::uint64_t key;
  std::uint32_t index;
};

/// The indices of positions in a box along a curve, equal ones next to each other.
std::vector<Keyed> order_along_curve(std::span<const GridPoint> positions, const GridBox& box) {
  std::vector<Keyed> order(positions.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {curve_key(positions[i], box), i};
  std::sort(order.begin(), order.end(), [&](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : positions[a.index] < positions[b.index];
  });
  return order;
}

}  // namespace

DistinctPositions::DistinctPositions(std::span<const std::byte> records, std::size_t stride,
                                     const GridBox& box) {
  std::vector<GridPoint> all(records.size() / stride);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = position_of(records.data() + i * stride);
  of_record.resize(all.size());
  for (const Keyed& next : order_along_curve(all, box)) {
    if (positions.empty() || positions.back() != all[next.index])
      positions.push_back(all[next.index]);
    of_record[next.index] = static_cast<std::uint32_t>(positions.size() - 1);
  }
}

std::vector<GridPoint> distinct_within(std::span<const std::byte> records, std::size_t stride,
                                       const GridBox& region) {
  std::vector<GridPoint> inside, distinct;
  for (std::size_t at = 0; at < records.size(); at += stride)
    if (const GridPoint p = position_of(records.data() + at); region.contains(p))
      inside.push_back(p);
  for (const Keyed& next : order_along_curve(inside, region))
    if (distinct.empty() || distinct.back() != inside[next.index])
      distinct.push_back(inside[next.index]);
  return distinct;
}

}  // namespace cairn::stages
