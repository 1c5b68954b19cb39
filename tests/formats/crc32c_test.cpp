// CRC-32C against published values and its definition, by instruction and by tables.
#include "formats/crc32c.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <numeric>
#include <string_view>
#include <vector>

namespace cairn::formats {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

TEST(Crc32c, IsThatOfTheIscsiStandard) {
  // RFC 3720, appendix B.4, and the check value of the catalogue of CRC algorithms.
  std::array<std::byte, 32> zeros{}, ones{}, rising{}, falling{};
  ones.fill(std::byte{0xff});
  for (std::size_t i = 0; i < rising.size(); ++i) {
    rising[i] = static_cast<std::byte>(i);
    falling[i] = static_cast<std::byte>(31 - i);
  }
  for (const auto function : {crc32c, crc32c_by_tables}) {
    EXPECT_EQ(function(zeros), 0x8a9136aaU);
    EXPECT_EQ(function(ones), 0x62a8ab43U);
    EXPECT_EQ(function(rising), 0x46dd794eU);
    EXPECT_EQ(function(falling), 0x113fdb5cU);
    EXPECT_EQ(function(bytes_of("123456789")), 0xe3069283U);
    EXPECT_EQ(function({}), 0U);
  }
}

TEST(Crc32c, OfAnyLengthIsItsDefinitions) {
  std::vector<std::byte> bytes(1100);
  std::uint32_t state = 1;
  for (std::byte& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::byte>(state >> 24);
  }
  std::uint32_t crc = 0xffffffffU;
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    ASSERT_EQ(crc32c(std::span(bytes).first(size)), ~crc) << size;
    ASSERT_EQ(crc32c_by_tables(std::span(bytes).first(size)), ~crc) << size;
    if (size == bytes.size()) break;
    crc ^= static_cast<std::uint32_t>(bytes[size]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? (crc >> 1) ^ 0x82f63b78U : crc >> 1;
  }
}

}  // namespace
}  // namespace cairn::formats
