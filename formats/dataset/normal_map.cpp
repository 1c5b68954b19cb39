#include "formats/dataset/normal_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "formats/error.h"

namespace cairn::formats {
namespace {

// Face 2a + (s < 0) is the one where axis a has the sign s. With b and c the axes after a in cyclic
// order, its point (u, v) is the direction s * (e_a - u e_b + v e_c). The face owns the grid points of
// its edges u = -1 and v = -1 but not of u = +1 and v = +1. With these signs every edge of the cube has
// exactly one owner.
constexpr std::uint32_t kGrid = kNormalGrid;
constexpr std::uint32_t kHalf = kGrid / 2;
constexpr std::uint32_t kCornerCode = 6 * kGrid * kGrid;  // +(1,1,1); the next one is -(1,1,1)

constexpr std::array<std::uint32_t, 4> kNext{1, 2, 0,
                                             1};  // the axes after axis a are at a and a + 1

// Bends the grid lines: u = t (k + (1 - k) t^2) comes near to tan(t * 45 degrees), which would make the
// cells of a row equal. This k makes the largest error over the whole sphere smallest.
constexpr double kBend = 0.7;

/// The coordinates u of the grid lines, kGrid + 1 of them from -1 to 1; symmetric about line kHalf.
constexpr std::array<double, kGrid + 1> make_lines() {
  std::array<double, kGrid + 1> lines{};
  for (std::uint32_t i = 0; i <= kHalf; ++i) {
    const double t = static_cast<double>(i) / kHalf;
    const double u = t * (kBend + (1 - kBend) * t * t);
    lines[kHalf + i] = u;
    lines[kHalf - i] = -u;
  }
  return lines;
}
constexpr std::array<double, kGrid + 1> kLines = make_lines();

/// Where the search for a grid line starts: the last line at or below each of kBins intervals of u.
constexpr std::uint32_t kBins = 512;
constexpr std::array<std::uint8_t, kBins + 1> make_starts() {
  std::array<std::uint8_t, kBins + 1> starts{};
  std::uint32_t line = 0;
  for (std::uint32_t bin = 0; bin <= kBins; ++bin) {
    const double u = -1.0 + 2.0 * bin / kBins;
    while (line + 1 < kGrid && kLines[line + 1] <= u) ++line;
    starts[bin] = static_cast<std::uint8_t>(line);
  }
  return starts;
}
constexpr std::array<std::uint8_t, kBins + 1> kStarts = make_starts();

/// The cell [kLines[i], kLines[i + 1]] that holds u, for u in -1..1. The bins are narrower than the
/// cells, so at most one line lies inside a bin.
std::uint32_t cell_of(double u) {
  const std::uint32_t line = kStarts[static_cast<std::uint32_t>((u + 1.0) * (kBins * 0.5))];
  return std::min(line + (kLines[line + 1] <= u ? 1 : 0), kGrid - 1);
}

/// The code of vertex (i, j), each in 0..kGrid, of a face; vertices of foreign edges are looked up at
/// their owner.
std::uint32_t vertex_code(std::uint32_t face, std::uint32_t i, std::uint32_t j) {
  while (i == kGrid || j == kGrid) {
    const std::uint32_t axis = face / 2;
    const std::uint32_t negative = face % 2;
    if (i == kGrid) {  // the edge to axis b with the opposite sign
      face = kNext[axis] * 2 + (1 - negative);
      i = j;
      j = 0;
    } else if (i == 0) {
      return kCornerCode + negative;
    } else {  // the edge to axis c with the same sign
      face = kNext[axis + 1] * 2 + negative;
      j = kGrid - i;
      i = 0;
    }
  }
  return (face * kGrid + j) * kGrid + i;
}

Normal unit(double x, double y, double z) {
  const double length = std::sqrt(x * x + y * y + z * z);
  return {static_cast<float>(x / length), static_cast<float>(y / length),
          static_cast<float>(z / length)};
}

Normal direction_of(std::uint32_t code) {
  if (code >= kNormalCodes) return {0, 0, 0};
  if (code == kCornerCode) return unit(1, 1, 1);
  if (code == kCornerCode + 1) return unit(-1, -1, -1);
  const std::uint32_t face = code / (kGrid * kGrid);
  const std::uint32_t axis = face / 2;
  const double sign = face % 2 == 0 ? 1.0 : -1.0;
  std::array<double, 3> d{};
  d[axis] = sign;
  // Adding 0.0 makes the zero of an axis a positive one.
  d[kNext[axis]] = -sign * kLines[code % kGrid] + 0.0;
  d[kNext[axis + 1]] = sign * kLines[code / kGrid % kGrid] + 0.0;
  return unit(d[0], d[1], d[2]);
}

const std::vector<Normal>& table() {
  static const std::vector<Normal> normals = [] {
    std::vector<Normal> all(65536);
    for (std::uint32_t code = 0; code < all.size(); ++code) all[code] = direction_of(code);
    return all;
  }();
  return normals;
}

}  // namespace

std::uint16_t encode_normal(const Normal& n) {
  const std::array<double, 3> d{n[0], n[1], n[2]};
  const double x = std::abs(d[0]);
  const double y = std::abs(d[1]);
  const double z = std::abs(d[2]);
  // One of several equal components decides alike on all of them: a point of an edge has one vertex.
  const std::uint32_t axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  // Not finite: the sum is then infinite or NaN, while that of three floats cannot overflow a double.
  if (!std::isfinite(x + y + z) || d[axis] == 0) return kNoNormal;

  const double u = -(d[kNext[axis]] / d[axis]);
  const double v = d[kNext[axis + 1]] / d[axis];
  const std::uint32_t i = cell_of(u);
  const std::uint32_t j = cell_of(v);
  // Nearest by angle among the corners of the cell: the largest squared cosine, up to a common factor,
  // compared as dot^2 / norm with the division multiplied out. No branches: neighbours in a scan differ
  // at random here.
  std::uint32_t best = 0;
  double best_dot = 0;
  double best_norm = 1;
  for (std::uint32_t corner = 0; corner < 4; ++corner) {
    const double gu = kLines[i + corner % 2];
    const double gv = kLines[j + corner / 2];
    const double dot = 1 + u * gu + v * gv;
    const double norm = 1 + gu * gu + gv * gv;
    const bool nearer = dot * dot * best_norm > best_dot * best_dot * norm;
    best = nearer ? corner : best;
    best_dot = nearer ? dot : best_dot;
    best_norm = nearer ? norm : best_norm;
  }
  const std::uint32_t face = axis * 2 + (d[axis] < 0 ? 1 : 0);
  return static_cast<std::uint16_t>(vertex_code(face, i + best % 2, j + best / 2));
}

const Normal& decode_normal(std::uint16_t code) { return table()[code]; }
std::span<const Normal> decoded_normals() { return table(); }

}  // namespace cairn::formats
