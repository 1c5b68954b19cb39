// The clustering grid: cells are runs of the curve order that share the leading bits of their keys.
// Based on: Goswami et al. 2010, procedure Representatives (Figure 4), whose cells of a K^3 grid these
// are. A cell with more points than a list may have is cut into equal runs along the curve, so that the time
// of merging, which grows with the square of a list's length (times its rounds, a few), stays in bounds.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace cairn::stages {

/// Points of the longest list that there can be: where a grid is given, coarse cells are there for the sake of accuracy.
inline constexpr std::uint32_t kMaxListLength = 256;

/// Points a cell that `auto` aims at, and those of its longest list: fewer leave the error larger, more cost time that grows
/// with their square.
inline constexpr double kAutoCellPoints = 16;
inline constexpr std::uint32_t kAutoListLength = 32;

/// The number of leading bits a coordinate (0 to 16) for which occupied cells hold closest to
/// kAutoCellPoints keys on average. `keys` ascending, not empty.
int auto_cell_bits(std::span<const std::uint64_t> keys);

/// Start of each list, and last the number of keys: list i is [starts[i], starts[i + 1]), at most `longest` (1 to
/// kMaxListLength) of them. `keys` ascending; cells share the leading 3 * cell_bits bits.
std::vector<std::uint32_t> cut_lists(std::span<const std::uint64_t> keys, int cell_bits,
                                     std::uint32_t longest);

/// The length of the longest list once all add up to `quota`, if the longest list is shortened by one again and again, but
/// no list below one. Requires quota <= sum of `lengths`, all lengths from 1 to kMaxListLength.
std::uint32_t leveled_length(std::span<const std::uint32_t> lengths, std::uint64_t quota);

}  // namespace cairn::stages
