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
  std::uint32_t record;
};

}  // namespace

DistinctPositions::DistinctPositions(std::span<const std::byte> records, std::size_t stride,
                                     const GridBox& box) {
  const std::size_t count = records.size() / stride;
  std::vector<GridPoint> position(count);
  std::vector<Keyed> order(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    position[i] = position_of(records.data() + i * stride);
    order[i] = {curve_key(position[i], box), i};
  }
  std::sort(order.begin(), order.end(), [&](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : position[a.record] < position[b.record];
  });
  of_record.resize(count);
  for (const Keyed& next : order) {
    if (positions.empty() || positions.back() != position[next.record])
      positions.push_back(position[next.record]);
    of_record[next.record] = static_cast<std::uint32_t>(positions.size() - 1);
  }
}

std::vector<GridPoint> distinct_within(std::span<const std::byte> records, std::size_t stride,
                                       const GridBox& region) {
  std::vector<GridPoint> positions;
  for (std::size_t at = 0; at < records.size(); at += stride)
    if (const GridPoint p = position_of(records.data() + at); region.contains(p))
      positions.push_back(p);
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  return positions;
}

}  // namespace cairn::stages
