#include "formats/crc32c.h"

#include <array>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

constexpr std::uint32_t kPolynomial = 0x82f63b78U;  // reflected
constexpr std::size_t kWordBytes = sizeof(std::uint64_t);

using Tables = std::array<std::array<std::uint32_t, 256>, kWordBytes>;

/// Entry b of table t: what byte b does to the checksum when t more bytes follow it.
constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t t = 1; t < kWordBytes; ++t)
    for (std::size_t byte = 0; byte < 256; ++byte)
      tables[t][byte] = (tables[t - 1][byte] >> 8) ^ tables[0][tables[t - 1][byte] & 0xff];
  return tables;
}

constexpr Tables kTables = make_tables();

[[gnu::target("sse4.2")]] std::uint32_t by_instruction(std::span<const std::byte> bytes) {
  std::uint64_t crc = 0xffffffffU;
  std::size_t i = 0;
  for (; i + kWordBytes <= bytes.size(); i += kWordBytes)
    crc = __builtin_ia32_crc32di(crc, load_le<std::uint64_t>(&bytes[i]));
  for (; i < bytes.size(); ++i)
    crc = __builtin_ia32_crc32qi(static_cast<std::uint32_t>(crc),
                                 static_cast<unsigned char>(bytes[i]));
  return ~static_cast<std::uint32_t>(crc);
}

}  // namespace

std::uint32_t crc32c_by_tables(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xffffffffU;
  std::size_t i = 0;
  for (; i + kWordBytes <= bytes.size(); i += kWordBytes) {
    const std::uint64_t word = load_le<std::uint64_t>(&bytes[i]) ^ crc;
    crc = 0;
    for (std::size_t t = 0; t < kWordBytes; ++t)
      crc ^= kTables[kWordBytes - 1 - t][(word >> (8 * t)) & 0xff];
  }
  for (; i < bytes.size(); ++i)
    crc = (crc >> 8) ^ kTables[0][(crc ^ static_cast<std::uint32_t>(bytes[i])) & 0xff];
  return ~crc;
}

std::uint32_t crc32c(std::span<const std::byte> bytes) {
  static const bool has_instruction = __builtin_cpu_supports("sse4.2") != 0;
  return has_instruction ? by_instruction(bytes) : crc32c_by_tables(bytes);
}

}  // namespace cairn::formats
