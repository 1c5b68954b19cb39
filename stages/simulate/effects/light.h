// How much light a surface sends back.
#pragma once

#include <array>

#include "stages/simulate/echo.h"

namespace cairn::stages {

/// Light of a colour channel, 0 to 1, by the curve of sRGB (IEC 61966-2-1), and back, rounded and clamped.
double linear_light(std::uint8_t channel);
std::uint8_t encoded_light(double light);

/// Share of the light that a surface of this colour scatters: its luminance, 0.2126 R + 0.7152 G + 0.0722 B of
/// linear light (ITU-R BT.709).
double reflectance(const Rgb& surface);

/// The laser radar equation for a surface that is wider than the beam and scatters as Lambert says, relative to a
/// white surface at `reference_range` that faces the scanner: rho cos(alpha) (reference_range / R)^2, times the share of
/// the beam that met the surface.
/// Based on: Bernhard Höfle and Norbert Pfeifer, "Correction of laser scanning intensity data: data and
/// model-driven approaches", ISPRS Journal of Photogrammetry and Remote Sensing 62(6), 2007.
double returned_power(const Echo& echo, double reference_range);

}  // namespace cairn::stages
