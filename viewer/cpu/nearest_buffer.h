// Depth and color of a pixel in one 64-bit word, so that many threads keep the nearest fragment without a lock.
// Based on: Schütz, Kerbl, Wimmer, "Rendering Point Clouds with Compute Shaders and Vertex Order Optimization", 2021.
// The float bits of the depth, which are ordered as depths above 0 are, stand above the color: the least word is the
// nearest fragment, and of equally near ones that of the least color, whatever the order in which they come.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>

namespace cairn::viewer {

inline constexpr std::uint64_t kNoFragment = ~std::uint64_t{0};
inline constexpr std::uint32_t kNoDepth = ~std::uint32_t{0};
inline constexpr std::uint32_t kRgbMask = 0xffffff;

/// Requires depth > 0.
inline std::uint64_t pixel_word(float depth, std::uint32_t rgb) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | rgb;
}

/// Makes `place` the lesser of itself and `value`; any thread.
template <typename Word>
void keep_least(Word& place, Word value) {
  const std::atomic_ref<Word> shared(place);
  Word there = shared.load(std::memory_order_relaxed);
  while (value < there && !shared.compare_exchange_weak(there, value, std::memory_order_relaxed)) {
  }
}

}  // namespace cairn::viewer
