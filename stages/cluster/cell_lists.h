// The clustering grid: cells are runs of the curve order that share the leading bits of their keys.
// Based on: Goswami et al. 2010, procedure Representatives (Figure 4), whose cells of a K^3 grid these
// are. A cell of more than kMaxListLength points is cut into equal runs along the curve, so that no
// list is ever long enough for its quadratic merging to matter.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace cairn::stages {

inline constexpr std::uint32_t kMaxListLength = 32;

/// Points a cell that `auto` aims at: fewer leave the error larger, more cost time that grows with their square.
inline constexpr double kAutoCellPoints = 16;

/// The number of leading bits a coordinate (0 to 16) for which occupied cells hold closest to
/// kAutoCellPoints keys on average. `keys` ascending, not empty.
int auto_cell_bits(std::span<const std::uint64_t> keys);

/// Start of each list, and last the number of keys: list i is [starts[i], starts[i + 1]). `keys`
/// ascending; cells share the leading 3 * cell_bits bits.
std::vector<std::uint32_t> cut_lists(std::span<const std::uint64_t> keys, int cell_bits);

/// The length of the longest list once all add up to `quota`, if the longest list is shortened by one again and again, but
/// no list below one. Requires quota <= sum of `lengths`, all lengths from 1 to kMaxListLength.
std::uint32_t leveled_length(std::span<const std::uint32_t> lengths, std::uint64_t quota);

}  // namespace cairn::stages
