#include "formats/dataset/hilbert.h"

namespace cairn::formats {
namespace {

constexpr unsigned kAxes = 3;

constexpr unsigned rotate_left(unsigned bits, unsigned by) {
  by %= kAxes;
  return ((bits << by) | (bits >> (kAxes - by))) & 7u;
}
constexpr unsigned rotate_right(unsigned bits, unsigned by) {
  return rotate_left(bits, kAxes - by % kAxes);
}
constexpr unsigned gray(unsigned i) { return i ^ (i >> 1); }
constexpr unsigned gray_inverse(unsigned g) { return g ^ (g >> 1) ^ (g >> 2); }
constexpr unsigned trailing_ones(unsigned i) {
  unsigned count = 0;
  for (; (i & 1u) != 0; i >>= 1) ++count;
  return count;
}

/// Corner by which the curve enters sub-cube `w` of the unrotated pattern.
constexpr unsigned entry(unsigned w) { return w == 0 ? 0 : gray(2 * ((w - 1) / 2)); }
/// Axis along which it passes through that sub-cube.
constexpr unsigned direction(unsigned w) {
  if (w == 0) return 0;
  return trailing_ones(w % 2 == 0 ? w - 1 : w) % kAxes;
}

struct Step {
  std::uint8_t digit;  ///< which eighth of the curve the octant is
  std::uint8_t next;   ///< state inside that octant
};

/// State 3 e + d: the curve enters at corner e and runs along axis d. Octant bits: x 1, y 2, z 4.
constexpr std::array<std::array<Step, 8>, 24> make_steps() {
  std::array<std::array<Step, 8>, 24> steps{};
  for (unsigned e = 0; e < 8; ++e)
    for (unsigned d = 0; d < kAxes; ++d)
      for (unsigned octant = 0; octant < 8; ++octant) {
        const unsigned w = gray_inverse(rotate_right(octant ^ e, d + 1));
        const unsigned next_e = e ^ rotate_left(entry(w), d + 1);
        const unsigned next_d = (d + direction(w) + 1) % kAxes;
        steps[3 * e + d][octant] = {static_cast<std::uint8_t>(w),
                                    static_cast<std::uint8_t>(3 * next_e + next_d)};
      }
  return steps;
}

constexpr auto kSteps = make_steps();

}  // namespace

std::uint64_t hilbert_key(std::uint16_t x, std::uint16_t y, std::uint16_t z) {
  std::uint64_t key = 0;
  unsigned state = 0;
  for (int bit = kHilbertBits - 1; bit >= 0; --bit) {
    const unsigned octant = ((x >> bit) & 1u) | (((y >> bit) & 1u) << 1) | (((z >> bit) & 1u) << 2);
    const Step step = kSteps[state][octant];
    key = key << 3 | step.digit;
    state = step.next;
  }
  return key;
}

}  // namespace cairn::formats
