#include "formats/scans/column_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "formats/scalar_value.h"
#include "formats/scans/parse_number.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kFloatDigits = std::numeric_limits<float>::digits10;
// Whole numbers that float32 holds without gaps.
constexpr std::int64_t kFloatWhole = std::int64_t{1} << std::numeric_limits<float>::digits;
// Whole numbers below this are exact as doubles.
constexpr double kExactWhole = 9007199254740992.0;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// From the first digit that is not zero to the last one.
std::size_t significant_digits(std::string_view field) {
  std::size_t digits = 0, up_to_last = 0;
  for (const char c : field) {
    if (c == 'e' || c == 'E') break;
    if (!is_digit(c) || (digits == 0 && c == '0')) continue;
    ++digits;
    if (c != '0') up_to_last = digits;
  }
  return up_to_last;
}

/// Whether float32 gives back the decimal digits of a number.
bool fits_float(std::string_view field, double value) {
  constexpr double kLeast = 1e-37, kMost = 1e38;
  const double size = std::fabs(value);
  if (std::isfinite(value) && value != 0 && (size < kLeast || size > kMost)) return false;
  return significant_digits(field) <= kFloatDigits;
}

}  // namespace

bool ColumnValues::add(std::string_view field, double& value) {
  // Nearly all attributes are short whole numbers.
  constexpr std::size_t kMostDigits = 18;
  if (field.empty() || field.size() > kMostDigits) return add_other(field, value);
  std::int64_t whole = 0;
  for (const char c : field) {
    if (!is_digit(c)) return add_other(field, value);
    whole = 10 * whole + (c - '0');
  }
  value = static_cast<double>(whole);
  add_whole(whole);
  return true;
}

bool ColumnValues::add_other(std::string_view field, double& value) {
  std::int64_t whole = 0;
  if (parse_number(field, ScalarType::kI64, reinterpret_cast<std::byte*>(&whole))) {
    value = static_cast<double>(whole);
    add_whole(whole);
    return true;
  }
  std::uint64_t large = 0;
  if (parse_number(field, ScalarType::kU64, reinterpret_cast<std::byte*>(&large))) {
    value = static_cast<double>(large);
    add_whole(large);
    return true;
  }
  if (!parse_number(field, ScalarType::kF64, reinterpret_cast<std::byte*>(&value))) return false;
  if (std::fabs(value) < kExactWhole && value == std::trunc(value)) {
    add_whole(static_cast<std::int64_t>(value));
  } else {
    whole_ = false;
    few_digits_ = few_digits_ && fits_float(field, value);
  }
  return true;
}

void ColumnValues::add_whole(Int128 value) {
  least_ = any_whole_ ? std::min(least_, value) : value;
  most_ = any_whole_ ? std::max(most_, value) : value;
  any_whole_ = true;
}

void ColumnValues::add(const ColumnValues& other) {
  whole_ = whole_ && other.whole_;
  few_digits_ = few_digits_ && other.few_digits_;
  if (!other.any_whole_) return;
  add_whole(other.least_);
  add_whole(other.most_);
}

bool ColumnValues::are_whole_in(Int128 least, Int128 most) const {
  return whole_ && (!any_whole_ || (least_ >= least && most_ <= most));
}

ScalarType ColumnValues::narrowest_type() const {
  using enum ScalarType;
  for (const ScalarType type : {kU8, kI8, kU16, kI16, kU32, kI32, kI64, kU64})
    if (fit(type)) return type;
  return few_digits_ && (!any_whole_ || (least_ >= -kFloatWhole && most_ <= kFloatWhole)) ? kF32
                                                                                          : kF64;
}

bool ColumnValues::fit(ScalarType type) const {
  return with_scalar_type(type, [&]<typename T>(T) {
    if constexpr (std::is_floating_point_v<T>)
      return true;
    else
      return are_whole_in(std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
  });
}

bool parse_field(std::string_view field, ScalarType type, std::byte* to) {
  if (parse_number(field, type, to)) return true;
  double value = 0;
  if (!parse_number(field, ScalarType::kF64, reinterpret_cast<std::byte*>(&value)) ||
      !(std::fabs(value) < kExactWhole) || value != std::trunc(value))
    return false;
  return with_scalar_type(type, [&]<typename T>(T) {
    if constexpr (std::is_floating_point_v<T>) {
      return false;
    } else {
      // Both bounds are doubles: 2^63 and 2^64 lie beyond kExactWhole.
      if (value < static_cast<double>(std::numeric_limits<T>::min()) ||
          value > static_cast<double>(std::numeric_limits<T>::max()))
        return false;
      store_le(to, static_cast<T>(value));
      return true;
    }
  });
}

}  // namespace cairn::formats
