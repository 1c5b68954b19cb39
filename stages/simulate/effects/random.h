// Random numbers that are a function of what they are for, not of what was drawn before: the same on any number of
// threads, and untouched by what other effects draw.
//
// Based on: John K. Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011 (Philox4x32-10); normal
// numbers by George E. P. Box and Mervin E. Muller, "A note on the generation of random normal deviates", Annals of
// Mathematical Statistics 29(2), 1958.
#pragma once

#include <array>
#include <cstdint>

namespace cairn::stages {

/// Four random words of a counter under a key.
std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key);

/// The numbers of one effect at one station.
class Draws {
 public:
  /// `effect` is below 2^16.
  Draws(std::uint64_t seed, std::uint32_t station, std::uint32_t effect)
      : seed_(seed), station_(station), effect_(effect) {}

  /// Two independent numbers, uniform in (0, 1) without its ends. `draw` (below 2^16) tells several of a ray apart.
  std::array<double, 2> uniform(std::uint64_t ray, std::uint32_t draw = 0) const;
  /// Two independent normal numbers of mean 0 and variance 1:
  /// sqrt(-2 ln u) cos(2 pi v) and sqrt(-2 ln u) sin(2 pi v) of two uniform ones.
  std::array<double, 2> normal(std::uint64_t ray, std::uint32_t draw = 0) const;

 private:
  std::uint64_t seed_;
  std::uint32_t station_, effect_;
};

}  // namespace cairn::stages
