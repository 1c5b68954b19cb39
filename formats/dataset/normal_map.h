// Unit normals as 16-bit codes of a cube map, and back.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point
// Models Using Multi-way kd-Trees", 2010, section III.C: a look-up table of the points of a 104 x 104
// grid on each of the 6 faces of a cube. Where it departs:
//  - The grid's points are the vertices of 104 x 104 cells a face, each shared vertex owned by one face,
//    so that the axes, which walls and floors have as normals, decode exactly. A cube of n x n cells a
//    face has 6 n^2 + 2 vertices; the two left over, +-(1,1,1), have the codes 64,896 and 64,897.
//  - The grid lines are bent so that cells are of nearly equal angular size.
//  - Code 65,535 means that there is no normal.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace cairn::formats {

using Normal = std::array<float, 3>;

/// Cells along an edge of a cube face.
inline constexpr std::uint32_t kNormalGrid = 104;
/// Codes below this one stand for a direction, the others for none.
inline constexpr std::uint32_t kNormalCodes = 6 * kNormalGrid * kNormalGrid + 2;
/// The code of a point without a normal; it decodes to (0, 0, 0).
inline constexpr std::uint16_t kNoNormal = 65535;
/// No direction is farther than this from the direction of its code, in degrees.
inline constexpr double kMaxNormalErrorDegrees = 0.575;

/// The code of the direction nearest to `n`, which may have any length. A normal of length zero, or
/// with a component that is infinite or NaN, gives kNoNormal. Of directions equally near, the choice is
/// fixed. Uses only + - * / on doubles, so that it gives the same code everywhere.
std::uint16_t encode_normal(const Normal& n);

/// The unit normal of a code (each component within 1e-7 of a true unit vector), or zero for kNoNormal
/// and for the codes that stand for nothing.
const Normal& decode_normal(std::uint16_t code);
/// Those of all codes.
std::span<const Normal> decoded_normals();

}  // namespace cairn::formats
