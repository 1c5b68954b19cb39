#include "formats/dataset/normal_column.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/bytes.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

/// A direction as float32 whatever its length: float64 components are scaled by their largest first.
Normal narrowed(const double (&n)[3]) {
  const double largest = std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])});
  if (!(largest > 0) || !std::isfinite(largest)) return {0, 0, 0};
  Normal out;
  for (std::size_t a = 0; a < 3; ++a) out[a] = static_cast<float>(n[a] / largest);
  return out;
}

}  // namespace

Normal normal_at(std::span<const std::byte> column, ScalarType type, std::size_t index) {
  if (type == ScalarType::kF32) {
    const std::byte* at = column.data() + index * 12;
    return {load_le<float>(at), load_le<float>(at + 4), load_le<float>(at + 8)};
  }
  const std::byte* at = column.data() + index * 24;
  return narrowed({load_le<double>(at), load_le<double>(at + 8), load_le<double>(at + 16)});
}

std::vector<std::uint16_t> encode_normal_column(std::span<const std::byte> column,
                                                ScalarType type) {
  CAIRN_CHECK(type == ScalarType::kF32 || type == ScalarType::kF64);
  const std::size_t stride = 3 * size_bytes(type);
  CAIRN_CHECK(column.size() % stride == 0);
  std::vector<std::uint16_t> codes(column.size() / stride);
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes[i] = encode_normal(normal_at(column, type, i));
  return codes;
}

std::vector<std::byte> decode_normal_column(std::span<const std::uint16_t> codes, ScalarType type) {
  const std::size_t size = size_bytes(type);
  std::vector<std::byte> column(codes.size() * 3 * size);
  const std::span<const Normal> normals = decoded_normals();
  std::byte* to = column.data();
  if (type == ScalarType::kF32) {
    for (const std::uint16_t code : codes) {
      std::memcpy(to, normals[code].data(), sizeof(Normal));
      to += sizeof(Normal);
    }
    return column;
  }
  for (const std::uint16_t code : codes)
    for (const float c : normals[code]) {
      store_le(to, static_cast<double>(c));
      to += size;
    }
  return column;
}

}  // namespace cairn::formats
