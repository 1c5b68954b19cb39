// Golomb-Rice coding of small unsigned numbers in blocks, laid out for fast decoding.
// Based on: Rice, "Some practical universal noiseless coding techniques", 1979. Where it departs: the
// parameter is chosen for each block from the exact cost of each, and the unary quotients stand in a bit
// map of their own behind the fixed-width remainders, as in Elias-Fano lists, so that neither part of the
// decoder waits for the length of the code before.
//
// A block of n <= 64 values:
//   byte 0   low 7 bits: width w of the remainders, 0 to the bits of U; high bit: 1 if quotients follow
//   then     n * w bits, value i at bit i * w, least significant first, padded to a byte: value mod 2^w
//   then     if quotients follow: for each value, value >> w zeros and a one, padded to a byte with zeros
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace cairn::formats {

inline constexpr std::size_t kRiceBlock = 64;

/// Appends the code of 1 to kRiceBlock values to `out`: at most 1 + values.size_bytes() bytes.
template <std::unsigned_integral U>
void rice_encode(std::span<const U> values, std::vector<std::byte>& out);

/// Decodes values.size() <= kRiceBlock values from the start of `bytes` and returns how many bytes they
/// took; nothing if the bytes end too early or name a width that U does not have.
template <std::unsigned_integral U>
[[nodiscard]] std::optional<std::size_t> rice_decode(std::span<const std::byte> bytes,
                                                     std::span<U> values);

}  // namespace cairn::formats
