// Synthetic scans of any size, the same points for the same arguments.
//
// A shape is a surface over the unit square. It is sampled the way a scanner sweeps: row after row with a jittered step,
// denser towards the middle of each row, with range noise along the normal. All shapes share one frame in metres, so
// that scans of different shapes and seeds make one campaign. (Between machines a last digit may differ, as the C library's
// sine does between processors.)
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace cairn::bench {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  Vec3 operator+(Vec3 o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec3 operator-(Vec3 o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec3 operator*(double f) const { return {x * f, y * f, z * f}; }
};

struct Point {
  Vec3 position, normal;
  std::array<std::uint8_t, 3> colour;
  std::uint16_t intensity;
};

using Surface = Vec3 (*)(double u, double v);

/// By name.
const std::map<std::string, Surface>& shapes();

/// Calls `take(point)` for exactly `count` points, in the order of a sweep.
void sweep(Surface surface, std::uint64_t count, std::uint64_t seed,
           const std::function<void(const Point&)>& take);

}  // namespace cairn::bench
