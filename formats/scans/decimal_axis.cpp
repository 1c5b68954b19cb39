#include "formats/scans/decimal_axis.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "formats/wide_int.h"

namespace cairn::formats {
namespace {

constexpr int kMostPlaces = 12;
constexpr std::int64_t kMostUnits = 999'999'999'999'999'999;

/// digits * 10^exponent, the digits without trailing zeros.
struct Decimal {
  std::int64_t digits = 0;
  int exponent = 0;

  int places() const { return std::max(0, -exponent); }
};

/// The shortest that reads back as `value`: at most 17 digits.
Decimal shortest(double value) {
  std::array<char, 32> text{};
  const char* end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::scientific)
          .ptr;
  Decimal decimal;
  const char* at = text.data() + (value < 0 ? 1 : 0);
  bool past_point = false;
  for (; at != end && *at != 'e'; ++at) {
    if (*at == '.') {
      past_point = true;
      continue;
    }
    decimal.digits = 10 * decimal.digits + (*at - '0');
    if (past_point) --decimal.exponent;
  }
  int exponent = 0;
  const bool plus = at + 1 != end && at[1] == '+';
  std::from_chars(at + (plus ? 2 : 1), end, exponent);
  decimal.exponent += exponent;
  if (decimal.digits == 0) return {};
  while (decimal.digits % 10 == 0) {
    decimal.digits /= 10;
    ++decimal.exponent;
  }
  if (value < 0) decimal.digits = -decimal.digits;
  return decimal;
}

/// In units of 10^-places, which are at least the decimal's; nothing beyond kMostUnits.
std::optional<std::int64_t> units_of(const Decimal& decimal, int places) {
  Int128 units = decimal.digits;
  for (int i = 0; i < decimal.exponent + places; ++i) {
    units *= 10;
    if (units > kMostUnits || units < -kMostUnits) return std::nullopt;
  }
  return static_cast<std::int64_t>(units);
}

}  // namespace

std::optional<DecimalAxis> DecimalAxis::of(double step, double offset) {
  const Decimal decimal_step = shortest(step), decimal_offset = shortest(offset);
  const int places = std::max(decimal_step.places(), decimal_offset.places());
  if (places > kMostPlaces) return std::nullopt;
  const auto steps = units_of(decimal_step, places), offsets = units_of(decimal_offset, places);
  if (!steps || !offsets) return std::nullopt;
  const Int128 reach = Int128{*steps} * (std::int64_t{1} << 31);
  if (reach + std::abs(*offsets) > kMostUnits) return std::nullopt;
  return DecimalAxis(*steps, *offsets, places);
}

char* DecimalAxis::write(char* to, std::int32_t i) const {
  const std::int64_t units = offset_ + step_ * i;
  if (units < 0) *to++ = '-';
  std::array<char, kMostBytes> digits{};
  char* const end =
      std::to_chars(digits.data(), digits.data() + digits.size(), std::abs(units)).ptr;
  const auto count = static_cast<int>(end - digits.data());
  if (places_ == 0) return std::copy(digits.data(), end, to);
  if (count <= places_) {
    *to++ = '0';
    *to++ = '.';
    to = std::fill_n(to, places_ - count, '0');
    return std::copy(digits.data(), end, to);
  }
  to = std::copy(digits.data(), end - places_, to);
  *to++ = '.';
  return std::copy(end - places_, end, to);
}

}  // namespace cairn::formats
