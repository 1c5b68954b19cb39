#include "formats/dataset/hilbert.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <map>

namespace cairn::formats {
namespace {

using Cell = std::array<int, 3>;

/// The cells of a lattice of 2^bits an axis, by the leading bits of their keys.
std::map<std::uint64_t, Cell> walk(int bits) {
  std::map<std::uint64_t, Cell> cells;
  const int shift = kHilbertBits - bits;
  for (int x = 0; x < 1 << bits; ++x)
    for (int y = 0; y < 1 << bits; ++y)
      for (int z = 0; z < 1 << bits; ++z)
        cells[hilbert_key(static_cast<std::uint16_t>(x << shift),
                          static_cast<std::uint16_t>(y << shift),
                          static_cast<std::uint16_t>(z << shift)) >>
              (3 * shift)] = {x, y, z};
  return cells;
}

// The defining properties of the curve: it visits every cell once, and steps to a neighbour each time.
TEST(HilbertKey, VisitsEveryCellAndStepsToNeighbours) {
  for (int bits = 1; bits <= 5; ++bits) {
    const auto cells = walk(bits);
    ASSERT_EQ(cells.size(), std::size_t{1} << (3 * bits));
    ASSERT_EQ(cells.rbegin()->first, cells.size() - 1);
    for (auto next = std::next(cells.begin()), previous = cells.begin(); next != cells.end();
         ++next, ++previous) {
      int distance = 0;
      for (int axis = 0; axis < 3; ++axis)
        distance += std::abs(next->second[axis] - previous->second[axis]);
      ASSERT_EQ(distance, 1);
    }
  }
}

TEST(HilbertKey, LeadingBitsAreTheCellOnTheCoarserLattice) {
  const auto coarse = walk(2);
  for (const auto& [key, cell] : walk(4)) {
    const Cell& parent = coarse.at(key >> 6);
    EXPECT_EQ(parent, (Cell{cell[0] >> 2, cell[1] >> 2, cell[2] >> 2}));
  }
}

}  // namespace
}  // namespace cairn::formats
