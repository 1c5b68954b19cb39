#include "formats/scans/parse_number.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

template <typename T>
std::optional<T> parse(std::string_view token, ScalarType type) {
  std::array<std::byte, 8> bytes{};
  if (!parse_number(token, type, bytes.data())) return std::nullopt;
  return load_le<T>(bytes.data());
}

TEST(ParseNumber, IntegersMustBeWholeAndInRange) {
  EXPECT_EQ(parse<std::int8_t>("-128", ScalarType::kI8), -128);
  EXPECT_EQ(parse<std::uint8_t>("+255", ScalarType::kU8), 255);
  EXPECT_EQ(parse<std::int64_t>("-9223372036854775808", ScalarType::kI64),
            std::numeric_limits<std::int64_t>::min());
  for (const char* bad : {"", "+", "-", "256", "-1", "1.0", "1e2", " 1", "1 ", "+-1", "0x10"})
    EXPECT_FALSE(parse<std::uint8_t>(bad, ScalarType::kU8)) << bad;
}

TEST(ParseNumber, FloatsOutOfRangeBecomeInfinityOrZero) {
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(parse<float>("1e39", ScalarType::kF32), infinity);
  EXPECT_EQ(parse<float>("-1e999999999999999999999", ScalarType::kF32), -infinity);
  EXPECT_EQ(parse<float>("1e-999999999999999999999", ScalarType::kF32), 0.0f);
  EXPECT_EQ(parse<double>("1e-400", ScalarType::kF64), 0.0);
  EXPECT_EQ(parse<double>("-1e400", ScalarType::kF64), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(
      parse<float>("0.00000000000000000000000000000000000000000000000000001", ScalarType::kF32),
      0.0f);
  EXPECT_EQ(parse<float>("100000000000000000000000000000000000000000", ScalarType::kF32), infinity);
  EXPECT_EQ(parse<double>("0e999999999999", ScalarType::kF64), 0.0);
  EXPECT_TRUE(std::signbit(parse<double>("-1e-400", ScalarType::kF64).value()));
}

TEST(ParseNumber, KnowsNonFiniteWords) {
  EXPECT_TRUE(std::isnan(parse<float>("nan", ScalarType::kF32).value()));
  EXPECT_TRUE(std::isnan(parse<double>("-NaN", ScalarType::kF64).value()));
  EXPECT_EQ(parse<float>("+Inf", ScalarType::kF32), std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace cairn::formats
