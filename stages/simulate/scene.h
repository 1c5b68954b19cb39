// What the simulated scanner sees, and where it stands. A description in memory: files are the caller's.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/scans/pose.h"
#include "stages/simulate/shape.h"

namespace cairn::stages {

using Rgb = std::array<std::uint8_t, 3>;

enum class Pattern : std::uint8_t {
  kPlain,
  kChecker,   ///< cubes of two colours, in the object's own frame
  kGradient,  ///< from the first colour at the object's lowest point to the second at its highest
};

struct Paint {
  Pattern pattern = Pattern::kPlain;
  Rgb first{200, 200, 200};
  Rgb second{60, 60, 60};
  double cube_size = 1;  ///< kChecker; above 0
};

struct SceneObject {
  ShapePtr shape;
  formats::Pose pose;  ///< of the shape's frame in the world: a rotation and a translation
  Paint paint;
  double leaf_area_density = 0;  ///< leaf area a unit of volume, for the effect foliage; 0: solid
  Vector3 walk{};                ///< there and back, for the effect moving_objects; 0: none
  double walk_time = 1;          ///< of there and back; above 0
};

/// Directions of the rays in the station's frame, in which x is azimuth 0, y azimuth 90 and z elevation 90
/// degrees. The ranges are divided into equal cells, and each ray goes through the middle of one, so that a full
/// circle has no direction twice. Rays are numbered column by column, from the lowest up.
struct Raster {
  double azimuth_begin = -180, azimuth_end = 180;    ///< degrees; ascending, at most 360 apart
  double elevation_begin = -60, elevation_end = 90;  ///< degrees; ascending, within -90 to 90
  std::uint64_t columns = 1, rows = 1;               ///< each at least 1 and at most kMostCells

  std::uint64_t rays() const { return columns * rows; }
  double azimuth(std::uint64_t column) const {
    return azimuth_begin + (azimuth_end - azimuth_begin) * (static_cast<double>(column) + 0.5) /
                               static_cast<double>(columns);
  }
  double elevation(std::uint64_t row) const {
    return elevation_begin + (elevation_end - elevation_begin) * (static_cast<double>(row) + 0.5) /
                                 static_cast<double>(rows);
  }
};
inline constexpr std::uint64_t kMostCells = std::uint64_t{1} << 20;

/// w, x, y, z; of length 1.
using Quaternion = std::array<double, 4>;

/// Turns by `roll` about x, then raises x towards z by `pitch`, then turns by `yaw` about z; degrees.
Quaternion turned(double yaw, double pitch, double roll);
/// The turn `second` after `first`.
Quaternion product(const Quaternion& second, const Quaternion& first);
/// A frame that is turned so and stands at `position`.
formats::Pose pose_at(const Vector3& position, const Quaternion& turn);

struct Station {
  std::string name;
  Vector3 position{};
  Quaternion turn{1, 0, 0, 0};
  Raster raster;
  double max_range = 100;  ///< above 0

  /// Of the station's frame in the world.
  formats::Pose pose() const { return pose_at(position, turn); }
};

struct Scene {
  std::vector<SceneObject> objects;
  std::vector<Station> stations;
};

/// The colour of an object at a point of its surface and the outward normal there, both in the object's frame.
/// `extent` is the object's shape->whole().
Rgb color_at(const Paint& paint, const Box& extent, const Vector3& point, const Vector3& normal);

}  // namespace cairn::stages
