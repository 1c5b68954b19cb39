// Where tiles stand on the Earth.
#pragma once

#include <array>

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

}  // namespace cairn::formats
