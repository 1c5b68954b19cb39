// The checksum of everything that Cairn writes: XXH3, 64 bits, seed 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace cairn::formats {

/// XXH3-64 of `bytes`. Finds damage, not forgery.
std::uint64_t checksum_of(std::span<const std::byte> bytes);

}  // namespace cairn::formats
