// Filters: reversible rearrangements that make the column of a node smaller, or easier to compress. Each
// is here because it wins clearly somewhere (measured on the bench surface, bytes a point with LZO1X-1):
//   constant  one value for all points: flags, classification, source of a node
//   runs      stretches of equal values: radii of local density 0.07 against 0.16 plain
//   rice      differences along the curve: positions 3.8 against 4.7 as planes, normals 0.9 against 1.3
//   planes    differences as byte planes: normals 0.87 where zstd follows
//   plain     text and other values with repetitions but no order
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/dataset/column.h"
#include "formats/dataset/lanes.h"
#include "formats/error.h"

namespace cairn::formats {

/// The values are on disk. Filtered bytes:
enum class Filter : std::uint8_t {
  kPlain = 0,     ///< the column
  kConstant = 1,  ///< the one point that all equal; nothing if there are no points
  kRuns = 2,      ///< u32 number of runs; length - 1 of each run, u8; the point of each run
  kPlanes =
      3,      ///< plan; for each lane, from its lowest byte to its highest: that byte of all points
  kRice = 4,  ///< plan; for each 64 points, for each lane: a block of rice.h
};
// A plan (lanes.h) is its flags, u8, followed if kFactor is set by the factor as a scalar of the column.

std::optional<Filter> filter_of(std::uint8_t value);

/// No filter's output is larger than this; a filter that would exceed it does not apply to the column.
std::size_t filtered_size_limit(const ColumnShape& shape);

/// The plan for the planes and rice filters, found by trying the sensible ones on a stretch of the column.
/// Requires column.size() == shape.size_bytes().
LanePlan choose_plan(std::span<const std::byte> column, const ColumnShape& shape);

/// Appends the filtered column to `out` and returns true, or returns false and leaves `out` as it was if
/// the filter does not apply: not constant, larger than filtered_size_limit. `plan` is used by kPlanes and
/// kRice alone. Requires column.size() == shape.size_bytes().
bool apply_filter(Filter filter, const LanePlan& plan, std::span<const std::byte> column,
                  const ColumnShape& shape, std::vector<std::byte>& out);

/// Restores the column from all bytes of `filtered`. Requires column.size() == shape.size_bytes(). Reads
/// and writes nothing outside of the spans, whatever `filtered` holds; after an error the content of
/// `column` is unspecified.
[[nodiscard]] std::optional<DecodeError> undo_filter(Filter filter,
                                                     std::span<const std::byte> filtered,
                                                     const ColumnShape& shape,
                                                     std::span<std::byte> column);

}  // namespace cairn::formats
