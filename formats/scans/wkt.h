// Well-known text of coordinate reference systems, as a tree. Both versions, WKT 1 (OGC 01-009, and what GDAL and ESRI
// make of it) and WKT 2 (ISO 19162), have this form: KEYWORD[value, value, ...].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::formats {

struct WktNode {
  std::string keyword;             ///< in upper case
  std::vector<std::string> texts;  ///< values in quotes and bare words, in order
  std::vector<double> numbers;
  std::vector<WktNode> children;

  /// The first child with one of these keywords; null if there is none.
  template <typename... Keywords>
  const WktNode* child(Keywords... keywords) const {
    for (const WktNode& node : children)
      if (((node.keyword == keywords) || ...)) return &node;
    return nullptr;
  }
};

/// What kind of coordinate reference system a node is.
enum class WktSystem : std::uint8_t {
  kProjected,
  kGeographic,  ///< degrees
  kGeocentric,  ///< lengths from the middle of the earth
  kGeodetic,    ///< one of both: its CS tells which
  kVertical,
  kCompound,
  kBound,
  kLocal,
};

/// Of a keyword of either version, short or long, in upper case. Nothing for one that begins no system.
std::optional<WktSystem> wkt_system(std::string_view keyword);
/// As above, but a geodetic system is told to be geographic or geocentric.
std::optional<WktSystem> wkt_system(const WktNode& node);

/// Of several systems in a row, as ESRI writes one of positions and one of heights, a compound one. Nothing for a text that
/// is none, is nested more than 32 deep or is longer than 1 MiB.
std::optional<WktNode> parse_wkt(std::string_view text);

}  // namespace cairn::formats
