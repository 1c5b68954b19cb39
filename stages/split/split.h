// Split: the imported records are divided top-down, each node along the longest axis of its tight box
// into N children of equal count, until the leaves of the balanced tree stand one after the other.
// Based on: Goswami et al. 2010, section III.B and the procedure NdTree of Figure 3.
#pragma once

#include <string_view>
#include <vector>

#include "formats/dataset/tree.h"
#include "stages/context.h"
#include "stages/imported_points.h"
#include "stages/split/rounding.h"

namespace cairn::stages {

/// All records in kd-order: the points of any node are the range Tree::input_range gives.
struct SplitPoints {
  formats::ExternalArray array;
  std::size_t stride = 0;  ///< bytes of a record: 12-byte grid position, then the attributes
  std::vector<Rounding>
      rounding;  ///< a scan: what mapping its positions to the grid rounded off; none: nothing was mapped
};

/// Consumes the imported points. Between two work arrays records are streamed while a node exceeds its share of the
/// memory, and handled in memory below that. `name` is that of its units and arrays: a job may split twice.
SplitPoints split(ImportedPoints&& imported, const formats::Tree& tree, Context& context,
                  std::string_view name = unit_log::kSplit);

/// SplitPoints::rounding of an earlier run, as the context's log tells it. Throws WorkLost if it does not.
std::vector<Rounding> rounding_of_split(const Context& context,
                                        std::string_view name = unit_log::kSplit);

}  // namespace cairn::stages
