// Choices that look random and follow from what is chosen among alone.
#pragma once

#include <cstdint>

namespace cairn::stages {

/// A well-mixed hash of two numbers (the finaliser of SplitMix64: Steele, Lea, Flood, 2014).
inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  std::uint64_t z = a * 0x9e3779b97f4a7c15ULL + b + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace cairn::stages
