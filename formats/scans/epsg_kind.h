// What kind of coordinate reference system an EPSG code names.
#pragma once

#include <cstdint>
#include <optional>

namespace cairn::formats {

enum class EpsgKind : std::uint8_t { kProjected, kGeographic2d };

/// Nothing for a code that names another kind (vertical, compound, geocentric, of three dimensions) or is not known.
std::optional<EpsgKind> epsg_kind(std::uint16_t code);

}  // namespace cairn::formats
