// Rounding that compiles to vector instructions, which std::lround does not.
#pragma once

#include <cstdint>

namespace cairn::viewer {

/// The nearest whole number, halves up. Requires 0 <= value < 2^31 - 1.
inline std::uint32_t rounded(float value) {
  const float raised = value + 0.5f;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(raised));
}

}  // namespace cairn::viewer
