// The numbers of representatives: along the curve, by their first point.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn::stages {

/// Renumbers `count` groups, each of which some point is of. `group_of`: for each point along the curve its group, any number
/// below that of points, afterwards by its new number. Returns the old numbers in the order of the new ones.
std::vector<std::uint32_t> number_along(std::size_t count, std::vector<std::uint32_t>& group_of);

}  // namespace cairn::stages
