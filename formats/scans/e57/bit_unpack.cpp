#include "formats/scans/e57/bit_unpack.h"

#include <algorithm>

#include "formats/bytes.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

// With up to 7 bits before it, a number of this many lies in eight bytes.
constexpr unsigned kMostInOneWord = 57;

/// Whole bytes, as most fields have.
template <typename T>
void unpack_whole(const std::byte* bytes, std::span<std::uint64_t> out) {
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = load_le<T>(bytes + i * sizeof(T));
}

void unpack_narrow(const std::byte* bytes, std::size_t bit, unsigned bits,
                   std::span<std::uint64_t> out) {
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  for (std::uint64_t& value : out) {
    value = (load_le<std::uint64_t>(bytes + bit / 8) >> (bit % 8)) & mask;
    bit += bits;
  }
}

void unpack_wide(const std::byte* bytes, std::size_t bit, unsigned bits,
                 std::span<std::uint64_t> out) {
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - bits);
  for (std::uint64_t& value : out) {
    const std::byte* at = bytes + bit / 8;
    const unsigned shift = bit % 8;
    // The ninth byte, shifted in two steps, since none shifts by 64.
    const std::uint64_t above = std::to_integer<std::uint64_t>(at[8]) << 1 << (63 - shift);
    value = ((load_le<std::uint64_t>(at) >> shift) | above) & mask;
    bit += bits;
  }
}

}  // namespace

void unpack_bits(std::span<const std::byte> bytes, unsigned first_bit, unsigned bits,
                 std::span<std::uint64_t> out) {
  CAIRN_CHECK(bits <= 64 && first_bit < 8);
  CAIRN_CHECK((first_bit + out.size() * bits + 7) / 8 + kUnpackPadding <= bytes.size());
  if (bits == 0) return std::fill(out.begin(), out.end(), 0);
  if (first_bit == 0 && bits == 8) return unpack_whole<std::uint8_t>(bytes.data(), out);
  if (first_bit == 0 && bits == 16) return unpack_whole<std::uint16_t>(bytes.data(), out);
  if (first_bit == 0 && bits == 32) return unpack_whole<std::uint32_t>(bytes.data(), out);
  if (first_bit == 0 && bits == 64) return unpack_whole<std::uint64_t>(bytes.data(), out);
  if (bits <= kMostInOneWord) return unpack_narrow(bytes.data(), first_bit, bits, out);
  unpack_wide(bytes.data(), first_bit, bits, out);
}

}  // namespace cairn::formats
