#include "formats/scans/parse_number.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>
#include <type_traits>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

/// A decimal number that T cannot hold: infinite if its exponent says so, else zero.
template <typename T>
T out_of_range(std::string_view token) {
  const bool negative = token.starts_with('-');
  // The greatest digit's decimal exponent decides; only its sign matters this far out of range.
  bool past_point = false, found = false;
  long magnitude = 0;
  std::size_t i = negative ? 1 : 0;
  for (; i < token.size() && token[i] != 'e' && token[i] != 'E'; ++i) {
    if (token[i] == '.') {
      past_point = true;
    } else {
      found = found || token[i] != '0';
      if (found && !past_point) ++magnitude;
      if (!found && past_point) --magnitude;
    }
  }
  if (i < token.size()) {
    const std::string_view exponent = token.substr(i + 1);
    const bool small = exponent.starts_with('-');
    const std::size_t skip = small || exponent.starts_with('+') ? 1 : 0;
    long value = 0;
    const auto parsed =
        std::from_chars(exponent.data() + skip, exponent.data() + exponent.size(), value);
    if (parsed.ec == std::errc::result_out_of_range) value = std::numeric_limits<long>::max() / 4;
    if (value > std::numeric_limits<long>::max() / 4) value = std::numeric_limits<long>::max() / 4;
    magnitude += small ? -value : value;
  }
  const T size = magnitude > 0 ? std::numeric_limits<T>::infinity() : T{0};
  return negative ? -size : size;
}

template <typename T>
bool parse_as(std::string_view token, std::byte* to) {
  T value{};
  const char* const end = token.data() + token.size();
  const auto parsed = std::from_chars(token.data(), end, value);
  if (parsed.ptr != end) return false;
  if constexpr (std::is_floating_point_v<T>) {
    if (parsed.ec == std::errc::result_out_of_range)
      value = out_of_range<T>(token);
    else if (parsed.ec != std::errc{})
      return false;
  } else if (parsed.ec != std::errc{}) {
    return false;
  }
  store_le(to, value);
  return true;
}

}  // namespace

bool parse_number(std::string_view token, ScalarType type, std::byte* to) {
  if (token.starts_with('+')) {
    token.remove_prefix(1);
    if (token.starts_with('-')) return false;
  }
  switch (type) {
    case ScalarType::kU8:
      return parse_as<std::uint8_t>(token, to);
    case ScalarType::kI8:
      return parse_as<std::int8_t>(token, to);
    case ScalarType::kU16:
      return parse_as<std::uint16_t>(token, to);
    case ScalarType::kI16:
      return parse_as<std::int16_t>(token, to);
    case ScalarType::kU32:
      return parse_as<std::uint32_t>(token, to);
    case ScalarType::kI32:
      return parse_as<std::int32_t>(token, to);
    case ScalarType::kU64:
      return parse_as<std::uint64_t>(token, to);
    case ScalarType::kI64:
      return parse_as<std::int64_t>(token, to);
    case ScalarType::kF32:
      return parse_as<float>(token, to);
    case ScalarType::kF64:
      return parse_as<double>(token, to);
  }
  return false;
}

}  // namespace cairn::formats
