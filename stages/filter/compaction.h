// What follows from the decisions of all effects: the kept records, one behind the other, and the ledger of the others.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/filter/cloud.h"
#include "stages/filter/filter.h"

namespace cairn::stages {

/// Writes the kept records, gains applied, to a new array "filter", with their numbers if `keep_numbers`, and counts
/// what became of all. Marks are those of `effects` effects, from 1. Requires that at least one point is kept.
FilteredPoints compact(Cloud& cloud, std::size_t effects, bool keep_numbers, Context& context);

}  // namespace cairn::stages
