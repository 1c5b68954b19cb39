// What the records of a coordinate reference system tell, as far as it decides whether points of two scans lie in the
// same one: codes, units, and the numbers of the projection. Of the registry of systems it knows kinds and units alone.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

enum class CrsKind : std::uint8_t {
  kProjected,
  kGeographic,  ///< degrees
  kGeocentric,
};

struct CrsFacts {
  std::string name;  ///< see crs_name
  std::optional<CrsKind> kind;
  std::optional<std::uint32_t> code;           ///< EPSG, of the horizontal system
  std::optional<std::uint32_t> vertical_code;  ///< EPSG, of the heights' system
  std::optional<double> unit_m;                ///< metres in a horizontal unit; none for degrees
  std::optional<double> vertical_unit_m;       ///< metres in a unit of height
  /// Numbers that define the system, by name ("false_easting", "inverse_flattening", "geotiff_3081").
  std::map<std::string, double> numbers;
  friend bool operator==(const CrsFacts&, const CrsFacts&) = default;
};

/// Of WKT, and what that does not tell of GeoTIFF keys; units that neither tells, of the EPSG codes. What is damaged tells
/// nothing.
CrsFacts crs_facts(std::span<const VariableLengthRecord> records);

/// "metre", "foot", "US survey foot", else "0.9144 m".
std::string unit_name(double metres);

enum class CrsMatch { kSame, kUnknown, kDifferent };

struct CrsComparison {
  CrsMatch match = CrsMatch::kUnknown;
  /// Of different ones, what differs and how each tells it: "unit of length", "metre", "foot".
  std::string what = {};
  std::string first = {};
  std::string second = {};
};

/// Whether two systems are the same. Different are those that contradict each other: other EPSG codes, units of length,
/// or defining numbers, degrees or geocentric coordinates in one of them. Names do not count, they are spelt in many ways. Unknown where
/// nothing that both tell says so.
CrsComparison compare_crs(std::span<const VariableLengthRecord> first,
                          std::span<const VariableLengthRecord> second);
CrsComparison compare_crs(const CrsFacts& first, const CrsFacts& second);

}  // namespace cairn::formats
