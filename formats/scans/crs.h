// A coordinate reference system given by the user, as the records that LAS files carry.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// The records that tell a CRS: of "EPSG:n" GeoTIFF keys that name the code, which must be one that is known as
/// projected or geographic of two dimensions, since the keys differ; of WKT (a text that begins like `PROJCS[`,
/// `COMPD_CS[`, ...) the OGC record. Nothing if the text is neither.
std::optional<std::vector<VariableLengthRecord>> crs_records(std::string_view text);

}  // namespace cairn::formats
