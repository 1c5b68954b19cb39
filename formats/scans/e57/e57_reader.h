// Reads E57, the exchange format of terrestrial scanners: scans with poses, described by XML, their points in bit-packed
// streams.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// Opens all scans of an E57 file: reads its XML and walks over the heads of all packets. Records whose coordinates are
/// marked as invalid hold no point. The sensor stands at the origin of the scan's frame where the file tells a pose that
/// moves it, coordinates are spherical, or points have rows or columns. See plan_records for what becomes of the fields.
/// Images are left out. Throws kInput for a file that is damaged, holds no scan or tells no positions, and where it ends
/// before what it claims; with `options.allow_truncated` the whole records that are left are kept, if the XML, which as a
/// rule stands at the end, is.
std::vector<std::unique_ptr<ScanReader>> open_e57(const std::filesystem::path& path,
                                                  const ScanOptions& options);

/// Whether the beginning of a file is that of an E57 file.
bool begins_e57(std::string_view beginning);

}  // namespace cairn::formats
