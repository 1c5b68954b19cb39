// Columns of many kinds for the tests of filters and sections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/bytes.h"
#include "formats/dataset/column.h"

namespace cairn::tests {

using Bytes = std::vector<std::byte>;

inline constexpr formats::ScalarType kAllTypes[] = {
    formats::ScalarType::kU8,  formats::ScalarType::kI8,  formats::ScalarType::kU16,
    formats::ScalarType::kI16, formats::ScalarType::kU32, formats::ScalarType::kI32,
    formats::ScalarType::kU64, formats::ScalarType::kI64, formats::ScalarType::kF32,
    formats::ScalarType::kF64};

/// What the scalars of a column are like.
enum class Content { kZero, kConstant, kNoise, kWalk, kSteps, kRuns, kExtremes, kScaled, kSmall };
inline constexpr Content kAllContents[] = {Content::kZero,     Content::kConstant, Content::kNoise,
                                           Content::kWalk,     Content::kSteps,    Content::kRuns,
                                           Content::kExtremes, Content::kScaled,   Content::kSmall};

/// One scalar as bits, given the one a point before.
inline std::uint64_t next_scalar(Content content, std::uint64_t before, std::mt19937_64& random) {
  switch (content) {
    case Content::kZero:
      return 0;
    case Content::kConstant:
      return 0x0123456789abcdef;
    case Content::kNoise:
      return random();
    case Content::kWalk:
      return before + random() % 33 - 16;
    case Content::kSteps:
      return before + (random() % 4 == 0 ? 1 : 0);
    case Content::kRuns:
      return random() % 20 == 0 ? random() : before;
    case Content::kExtremes:
      return random() % 2 == 0 ? 0 : ~std::uint64_t{0};
    case Content::kScaled:
      return random() % 256 * 257;
    case Content::kSmall:
      return random() % 5;
  }
  return 0;
}

/// A column of this shape and content; the low bits of each scalar are kept.
inline Bytes make_column(const formats::ColumnShape& shape, Content content,
                         std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  Bytes column(shape.size_bytes());
  std::vector<std::uint64_t> before(shape.components, 1000);
  std::byte* at = column.data();
  for (std::size_t i = 0; i < shape.count; ++i)
    for (std::uint64_t& scalar : before) {
      scalar = next_scalar(content, scalar, random);
      std::byte wide[8];
      formats::store_le(wide, scalar);
      for (std::size_t b = 0; b < shape.scalar_bytes(); ++b) *at++ = wide[b];
    }
  return column;
}

/// The bytes of typed values.
template <typename T>
Bytes bytes_of(std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  return Bytes(bytes.begin(), bytes.end());
}
template <typename T>
Bytes bytes_of(const std::vector<T>& values) {
  return bytes_of(std::span<const T>(values));
}

}  // namespace cairn::tests
