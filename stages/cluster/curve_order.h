// A node's points along the Hilbert curve through its box. One sort serves the clustering cells, which
// are runs of it, and the storage order.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/grid.h"

namespace cairn::stages {

struct CurveOrder {
  std::vector<std::uint32_t> order;  ///< point indices along the curve; equal keys by index
  std::vector<std::uint64_t> key;    ///< their keys of 48 bits, ascending
  double cells_per_unit = 0;         ///< lattice cells a world unit, the same on all axes
  int cell_bits =
      0;  ///< with a given K: leading bits a coordinate of a key that tell the clustering cell; else 16
};

/// Sorts the points of one node. The lattice has 2^16 cells along the longest world extent, or the
/// largest multiple K * 2^f below that where `cells` gives K (1 to 65536).
CurveOrder order_along_curve(const formats::Grid& grid, std::span<const formats::GridPoint> points,
                             std::optional<std::uint32_t> cells);

}  // namespace cairn::stages
