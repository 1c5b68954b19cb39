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

/// Two steps at once. Of 64 parts: the octant of the first step, times 8, and that of the second in it.
struct DoubleStep {
  std::uint8_t digits;
  std::uint8_t next;
};

constexpr std::array<std::array<DoubleStep, 64>, 24> make_double_steps() {
  std::array<std::array<DoubleStep, 64>, 24> steps{};
  for (unsigned state = 0; state < 24; ++state)
    for (unsigned part = 0; part < 64; ++part) {
      const Step first = kSteps[state][part / 8], second = kSteps[first.next][part % 8];
      steps[state][part] = {static_cast<std::uint8_t>(8 * first.digit + second.digit), second.next};
    }
  return steps;
}

constexpr auto kDoubleSteps = make_double_steps();

/// Two bits of a coordinate, three places apart.
constexpr std::array<unsigned, 4> kSpread{0, 1, 8, 9};

}  // namespace

std::uint64_t hilbert_key(std::uint16_t x, std::uint16_t y, std::uint16_t z) {
  std::uint64_t key = 0;
  unsigned state = 0;
  for (int bit = kHilbertBits - 2; bit >= 0; bit -= 2) {
    const unsigned part =
        kSpread[x >> bit & 3u] | kSpread[y >> bit & 3u] << 1 | kSpread[z >> bit & 3u] << 2;
    const DoubleStep step = kDoubleSteps[state][part];
    key = key << 6 | step.digits;
    state = step.next;
  }
  return key;
}

}  // namespace cairn::formats
