// Which properties of a PLY vertex become the position and which become attributes.
#pragma once

#include <optional>

#include "formats/scans/ply_header.h"
#include "formats/scans/row_layout.h"

namespace cairn::formats {

/// The layout of a vertex as a row: its scalar properties one after the other without padding, lists left
/// out; names as make_row_layout takes them. Returns nothing if x, y or z is missing or a list.
std::optional<RowLayout> make_ply_layout(const PlyElement& vertex, Schema& schema,
                                         PositionEncoding& encoding);

}  // namespace cairn::formats
