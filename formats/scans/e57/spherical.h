// Points given by range, azimuth and elevation.
// Based on: ASTM E2807-11, 2011, section 5 (the coordinate systems); W. J. Cody, W. Waite, "Software Manual for the
// Elementary Functions", 1980 (the reduction of the argument).
#pragma once

#include "formats/scans/pose.h"

namespace cairn::formats {

struct SineCosine {
  double sine = 0;
  double cosine = 0;
};

/// Of an angle in radians, to about 1e-16 up to a few turns. Unlike the C library's, the same bits on every processor:
/// positions follow from it. No numbers for an angle that is none.
SineCosine sine_cosine(double angle);

/// Azimuth is counted from +x towards +y, elevation from the xy plane towards +z; radians.
Vector3 from_spherical(double range, double azimuth, double elevation);

}  // namespace cairn::formats
