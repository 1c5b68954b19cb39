// How long the units of coordinate reference systems are that an EPSG code names.
#pragma once

#include <cstdint>
#include <optional>

namespace cairn::formats {

/// Metres in a unit of the coordinates of a projected system. Nothing for a code that names no such system.
std::optional<double> epsg_unit_m(std::uint16_t code);

/// Metres in a unit of a system of heights or depths, likewise.
std::optional<double> epsg_height_unit_m(std::uint16_t code);

}  // namespace cairn::formats
