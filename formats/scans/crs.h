// Coordinate reference systems as the records that LAS files carry.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// The records that tell a CRS: of "EPSG:n" GeoTIFF keys that name the code, which must be one that is known as
/// projected or geographic of two dimensions, since the keys differ; of WKT (a text that begins like `PROJCS[`,
/// `COMPD_CS[`, ...) the OGC record. Nothing if the text is neither.
std::optional<std::vector<VariableLengthRecord>> crs_records(std::string_view text);

/// The text of the first OGC WKT record.
std::optional<std::string> wkt_of(std::span<const VariableLengthRecord> records);

/// What people call the system that the records tell: the name in its WKT, else "EPSG:n" where GeoTIFF keys name a
/// code, else "unnamed"; empty if there are no records.
std::string crs_name(std::span<const VariableLengthRecord> records);

/// The system as one line of text that crs_records takes back: its WKT, else "EPSG:n" where GeoTIFF keys name a known
/// code. Empty where neither is told, or in more than 32 KiB.
std::string crs_text(std::span<const VariableLengthRecord> records);

/// Where a file has room for comments only, one that begins so tells crs_text.
inline constexpr std::string_view kCrsComment = "crs ";

/// The records that a comment tells which begins with kCrsComment; none for any other.
std::vector<VariableLengthRecord> crs_of_comment(std::string_view comment);

}  // namespace cairn::formats
