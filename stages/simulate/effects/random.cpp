#include "stages/simulate/effects/random.h"

#include <cmath>
#include <numbers>

namespace cairn::stages {
namespace {

/// The middle of one of 2^52 equal parts of (0, 1), which a double holds exactly.
double uniform_of(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t part = (std::uint64_t{high} << 32 | low) >> 12;
  return (static_cast<double>(part) + 0.5) * 0x1p-52;
}

}  // namespace

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t first = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t second = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {static_cast<std::uint32_t>(second >> 32) ^ counter[1] ^ key[0],
               static_cast<std::uint32_t>(second),
               static_cast<std::uint32_t>(first >> 32) ^ counter[3] ^ key[1],
               static_cast<std::uint32_t>(first)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return counter;
}

std::array<double, 2> Draws::uniform(std::uint64_t ray, std::uint32_t draw) const {
  const auto words =
      philox4x32({static_cast<std::uint32_t>(ray), static_cast<std::uint32_t>(ray >> 32), station_,
                  effect_ << 16 | draw},
                 {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
  return {uniform_of(words[0], words[1]), uniform_of(words[2], words[3])};
}

std::array<double, 2> Draws::normal(std::uint64_t ray, std::uint32_t draw) const {
  const auto [u, v] = uniform(ray, draw);
  const double radius = std::sqrt(-2 * std::log(u)), angle = 2 * std::numbers::pi * v;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace cairn::stages
