// Numbers from text, the same in every locale.
#pragma once

#include <cstddef>
#include <string_view>

#include "formats/schema.h"

namespace cairn::formats {

/// Parses all of `token` as a number of this type and writes it, little-endian, to the
/// size_bytes(type) bytes at `to`. Floating values are rounded once, to the type itself; "nan" and
/// "inf" are values; what is too large or small for the type becomes an infinity or zero. Integers
/// must be whole and in range. One leading "+" is allowed. Returns false, and writes nothing, if
/// the token is no such number.
[[nodiscard]] bool parse_number(std::string_view token, ScalarType type, std::byte* to);

}  // namespace cairn::formats
