// Keys along the three-dimensional Hilbert curve. Points whose keys are close are close in space, so
// sorting by key orders the points of a node, its clustering cells and the nodes in a file.
// Based on: C. Hamilton, "Compact Hilbert Indices", Dalhousie University CS-2006-07: entry points and
// directions of the sub-cubes; turned at compile time into a table so that a key takes a look-up for two bits.
#pragma once

#include <array>
#include <cstdint>

namespace cairn::formats {

/// Bits a coordinate: the curve runs through a lattice of 65536^3 cells and a key has 48 bits.
inline constexpr int kHilbertBits = 16;

/// The key of lattice cell (x, y, z). The key's leading 3 b bits are the key of the cell that contains
/// it on the lattice of 2^b cells an axis.
std::uint64_t hilbert_key(std::uint16_t x, std::uint16_t y, std::uint16_t z);

}  // namespace cairn::formats
