// Reads PTX, the text of Leica scanners: scans one after the other, each a header with its pose and then a line
// for every cell of its grid, column by column.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// Opens all scans of a PTX file with one pass over it. Header: columns, rows, scanner position, three axes, and a
/// 4 x 4 matrix whose last row is the translation (world = p * M); cells: x y z intensity [r g b]. A cell at exactly
/// 0 0 0 holds no point. The sensor stands at the origin of the scan's frame. Throws kInput for a damaged header or
/// cell, and for fewer cells than columns * rows unless `options.allow_truncated`.
std::vector<std::unique_ptr<ScanReader>> open_ptx(const std::filesystem::path& path,
                                                  const ScanOptions& options);

/// Whether the beginning of a text is the header of a PTX file.
bool begins_ptx(std::string_view beginning);

}  // namespace cairn::formats
