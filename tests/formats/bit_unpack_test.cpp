// Bit packing of every width against a reading of one bit after the other.
#include "formats/scans/e57/bit_unpack.h"

#include <gtest/gtest.h>

#include <vector>

namespace cairn::formats {
namespace {

std::uint64_t bit_by_bit(const std::vector<std::byte>& bytes, std::size_t first, unsigned bits) {
  std::uint64_t value = 0;
  for (unsigned i = 0; i < bits; ++i) {
    const std::size_t at = first + i;
    const std::uint64_t bit = std::to_integer<std::uint64_t>(bytes[at / 8]) >> at % 8 & 1;
    value |= bit << i;
  }
  return value;
}

TEST(BitUnpack, EveryWidthFromEveryBitIsThatReadBitByBit) {
  std::uint64_t state = 7;
  for (unsigned bits = 0; bits <= 64; ++bits)
    for (unsigned first = 0; first < 8; ++first) {
      constexpr std::size_t kCount = 67;
      // Of the exact size: what is read beyond it is found by the address sanitizer.
      std::vector<std::byte> bytes((first + kCount * bits + 7) / 8 + kUnpackPadding);
      for (std::byte& byte : bytes) {
        state = state * 6364136223846793005U + 1442695040888963407U;
        byte = static_cast<std::byte>(state >> 56);
      }
      std::vector<std::uint64_t> values(kCount, 99);
      unpack_bits(bytes, first, bits, values);
      for (std::size_t i = 0; i < kCount; ++i)
        ASSERT_EQ(values[i], bit_by_bit(bytes, first + i * bits, bits))
            << bits << " bits from bit " << first << ", value " << i;
    }
}

}  // namespace
}  // namespace cairn::formats
