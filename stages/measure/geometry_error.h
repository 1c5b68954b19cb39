// What measure finds of the geometry of a level: how far its splats are from the points that they stand for, how well
// they cover them, how evenly they lie, and how far they are from a surface that is known.
#pragma once

#include <cstdint>
#include <optional>

namespace cairn::stages {

/// Holds the true figure of all points with a probability of 95 %, where a figure is that of a sample.
struct Interval {
  double low = 0;
  double high = 0;
};

/// World units.
struct DistanceError {
  double rms = 0;
  std::optional<Interval> rms_interval;  ///< none: all points were measured
  double percentile_99 = 0;              ///< rounded up by at most 0.2 %
  double largest = 0;                    ///< of those that were measured
};

/// Of sampled points (of the leaves, or of the scans) against the splats of a level, whichever they belong to.
struct SurfaceError {
  std::uint64_t sampled = 0;
  DistanceError nearest;  ///< from the nearest representative
  DistanceError splat;    ///< from the nearest splat: see NearestSplats
  double uncovered = 0;   ///< share of the points that lie in no splat's sphere
  std::optional<Interval> uncovered_interval;  ///< none: all points were measured
  double overdraw = 0;                         ///< mean number of spheres that a point lies in
  /// By this factor all radii of the level would have to grow (or might shrink) for the spheres to cover 99.9 % of the
  /// points (rounded up by at most 0.2 %), and all of them. Infinite if no factor does it, as the radii are 0.
  double factor_99_9 = 0;
  double factor_all = 0;
};

/// How evenly the stored points of a level lie.
struct SpacingError {
  std::uint64_t sampled = 0;
  double mean = 0;  ///< world units: distance to the nearest other position of the level
  double variation =
      0;  ///< its standard deviation over the mean: 0 of a lattice, 0.52 at random in a plane
};

struct GeometryError {
  std::optional<SurfaceError> surface;  ///< none: not asked for, or nothing to compare with
  std::optional<SpacingError> spacing;  ///< none: not asked for, or all points are at one position
  std::optional<DistanceError> truth;   ///< of sampled stored points from the true surface
};

}  // namespace cairn::stages
