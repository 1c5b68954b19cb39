// Unpacks numbers of any width from a stream of bits, the lowest bit of the first byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace cairn::formats {

/// Bytes that must be readable behind the last one that holds bits.
inline constexpr std::size_t kUnpackPadding = 8;

/// Fills `out` with numbers of `bits` bits, 0 to 64, from bit `first_bit`, 0 to 7, of `bytes` on. Requires that `bytes`
/// hold them all and kUnpackPadding more.
void unpack_bits(std::span<const std::byte> bytes, unsigned first_bit, unsigned bits,
                 std::span<std::uint64_t> out);

}  // namespace cairn::formats
