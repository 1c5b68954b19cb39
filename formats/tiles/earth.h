// Where tiles stand on the Earth, and how long the units of the scans are.
#pragma once

#include <array>
#include <span>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// A place on the WGS84 ellipsoid.
struct GeographicPlace {
  double longitude_degrees = 0;
  double latitude_degrees = 0;
  double height_m = 0;  ///< above the ellipsoid
};

/// The matrix, by columns, that takes a frame of metres with x east, y north, z up, whose origin stands at `place`, to
/// the Earth-centred, Earth-fixed frame (EPSG:4978).
std::array<double, 16> east_north_up(const GeographicPlace& place);

/// What is known of a coordinate reference system from its records alone, without a library of projections.
struct CrsFrame {
  bool geocentric = false;     ///< coordinates are Earth-centred metres
  bool geographic = false;     ///< coordinates are degrees
  double metres_per_unit = 1;  ///< of horizontal lengths; 1 where no unit is told
};

/// From the WKT if there is one (the kind by its first word, also inside COMPD_CS, COMPOUNDCRS and BOUNDCRS; the unit by the last
/// LENGTHUNIT or UNIT of the system), else from the GeoTIFF keys (the model and the linear unit: metres or one of three
/// feet; for systems that a code names, without a unit key, metres).
CrsFrame crs_frame(std::span<const VariableLengthRecord> records);

}  // namespace cairn::formats
