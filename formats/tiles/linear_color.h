// Colours as glTF wants them: linear light, where pictures and scanners have sRGB.
// Clients show them again as sRGB (IEC 61966-2-1), but for CesiumJS, which takes a gamma of 2.2 for it: there a dark value is
// shown up to 8.5 of 255 brighter than it is. Dark values are therefore stored up to 2.5 darker, so that both kinds of
// clients show values from 31 on within 3 of 255; darker ones CesiumJS shows up to 6 brighter, all others within 3.
#pragma once

#include <cstdint>

namespace cairn::formats {

/// The linear value, 0 to 65535, of an sRGB value of `bits` (8 or 16) bits. Of 16 bits it is the nearest. Of 8 bits it is
/// within 0.45 of 255 on the screen and has as many zeros at its end as such values have: bright ones then have an empty
/// lower byte, which costs nothing in a stream of bytes (real colours take a third less). Values beyond the bits count
/// as the largest.
std::uint16_t linear_of_srgb(std::uint16_t value, unsigned bits);

}  // namespace cairn::formats
