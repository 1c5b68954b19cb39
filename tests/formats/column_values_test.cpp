// The types of text columns, from values at the edges of what each type holds.
#include "formats/scans/column_values.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

ScalarType type_of(const std::vector<std::string>& fields) {
  ColumnValues values;
  double value = 0;
  for (const std::string& field : fields) EXPECT_TRUE(values.add(field, value)) << field;
  // In parts, and from back to front, they must tell the same.
  ColumnValues joined;
  for (auto field = fields.rbegin(); field != fields.rend(); ++field) {
    ColumnValues part;
    EXPECT_TRUE(part.add(*field, value));
    joined.add(part);
  }
  EXPECT_EQ(joined.narrowest_type(), values.narrowest_type());
  return values.narrowest_type();
}

TEST(ColumnValues, TheNarrowestIntegerThatHoldsAllIsChosen) {
  EXPECT_EQ(type_of({"0", "255"}), ScalarType::kU8);
  EXPECT_EQ(type_of({"0", "256"}), ScalarType::kU16);
  EXPECT_EQ(type_of({"-1", "127"}), ScalarType::kI8);
  EXPECT_EQ(type_of({"-1", "128"}), ScalarType::kI16);
  EXPECT_EQ(type_of({"65535"}), ScalarType::kU16);
  EXPECT_EQ(type_of({"-32768", "32767"}), ScalarType::kI16);
  EXPECT_EQ(type_of({"4294967295"}), ScalarType::kU32);
  EXPECT_EQ(type_of({"-1", "2147483648"}), ScalarType::kI64);
  EXPECT_EQ(type_of({"-9223372036854775808", "9223372036854775807"}), ScalarType::kI64);
  EXPECT_EQ(type_of({"0", "9223372036854775807"}), ScalarType::kI64);
  EXPECT_EQ(type_of({"0", "9223372036854775808"}), ScalarType::kU64);
  EXPECT_EQ(type_of({"18446744073709551615"}), ScalarType::kU64);
  EXPECT_EQ(type_of({"117.0", "+2", "1e2"}), ScalarType::kU8);
}

TEST(ColumnValues, Float32IsChosenIfItGivesAllDigitsBack) {
  EXPECT_EQ(type_of({"0.123456", "123456", "-1e20"}), ScalarType::kF32);
  EXPECT_EQ(type_of({"0.00012345600"}), ScalarType::kF32);
  EXPECT_EQ(type_of({"0.1234567"}), ScalarType::kF64);
  EXPECT_EQ(type_of({"0.5", "16777217"}), ScalarType::kF64);
  EXPECT_EQ(type_of({"1e300"}), ScalarType::kF64);
  EXPECT_EQ(type_of({"18446744073709551616"}), ScalarType::kF64);
  EXPECT_EQ(type_of({"-1", "9223372036854775808"}), ScalarType::kF64);
  EXPECT_EQ(type_of({"nan", "1"}), ScalarType::kF32);
}

TEST(ColumnValues, WhatIsNoNumberIsTold) {
  double value = 0;
  for (const char* field : {"", "-", "1,5", "0x10", "1.5m", "1e", "++1", "."})
    EXPECT_FALSE(ColumnValues().add(field, value)) << field;
}

TEST(ColumnValues, FieldsAreParsedAsWholeNumbersInRangeAlone) {
  std::byte byte{};
  EXPECT_TRUE(parse_field("117.0", ScalarType::kU8, &byte));
  EXPECT_EQ(load_le<std::uint8_t>(&byte), 117);
  for (const char* field : {"117.5", "256", "256.0", "-1", "-1.0", "nan", "1e300", ""})
    EXPECT_FALSE(parse_field(field, ScalarType::kU8, &byte)) << field;
  EXPECT_EQ(load_le<std::uint8_t>(&byte), 117);
}

}  // namespace
}  // namespace cairn::formats
