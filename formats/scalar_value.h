// One scalar of a run-time type as a double, and back. Exact for every type but the upper part of the
// 64-bit integers.
#pragma once

#include "formats/bytes.h"
#include "formats/schema.h"

namespace cairn::formats {

/// Calls `visit` with a value of the C++ type that `type` names.
template <typename Visit>
decltype(auto) with_scalar_type(ScalarType type, Visit&& visit) {
  switch (type) {
    case ScalarType::kU8:
      return visit(std::uint8_t{});
    case ScalarType::kI8:
      return visit(std::int8_t{});
    case ScalarType::kU16:
      return visit(std::uint16_t{});
    case ScalarType::kI16:
      return visit(std::int16_t{});
    case ScalarType::kU32:
      return visit(std::uint32_t{});
    case ScalarType::kI32:
      return visit(std::int32_t{});
    case ScalarType::kU64:
      return visit(std::uint64_t{});
    case ScalarType::kI64:
      return visit(std::int64_t{});
    case ScalarType::kF32:
      return visit(float{});
    case ScalarType::kF64:
      break;
  }
  return visit(double{});
}

inline double load_scalar(const std::byte* at, ScalarType type) {
  return with_scalar_type(type, [&]<typename T>(T) { return static_cast<double>(load_le<T>(at)); });
}

/// Requires a value in the range of an integer type.
inline void store_scalar(std::byte* at, ScalarType type, double value) {
  with_scalar_type(type, [&]<typename T>(T) { store_le(at, static_cast<T>(value)); });
}

}  // namespace cairn::formats
