#include "formats/tiles/earth.h"

#include <cmath>
#include <numbers>

namespace cairn::formats {
namespace {

// The ellipsoid of WGS84: semi-major axis and inverse flattening.
constexpr double kSemiMajor = 6378137.0;
constexpr double kFlattening = 1 / 298.257223563;

}  // namespace

std::array<double, 16> east_north_up(const GeographicPlace& place) {
  const double longitude = place.longitude_degrees * std::numbers::pi / 180;
  const double latitude = place.latitude_degrees * std::numbers::pi / 180;
  const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
  const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
  const double eccentricity_squared = kFlattening * (2 - kFlattening);
  const double normal = kSemiMajor / std::sqrt(1 - eccentricity_squared * sin_lat * sin_lat);
  const double ring = (normal + place.height_m) * cos_lat;
  return {-sin_lon,
          cos_lon,
          0,
          0,
          -sin_lat * cos_lon,
          -sin_lat * sin_lon,
          cos_lat,
          0,
          cos_lat * cos_lon,
          cos_lat * sin_lon,
          sin_lat,
          0,
          ring * cos_lon,
          ring * sin_lon,
          (normal * (1 - eccentricity_squared) + place.height_m) * sin_lat,
          1};
}

}  // namespace cairn::formats
