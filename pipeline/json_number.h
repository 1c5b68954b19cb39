// Numbers of JSON texts: whole ones that come from outside, and those that JSON cannot write.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

namespace cairn::pipeline {

/// The number itself. Throws nlohmann's exception for any other value, where its own conversion would take all numbers, and
/// one that is out of range without a defined result.
inline std::uint64_t whole_number(const nlohmann::ordered_json& value) {
  return value.get_ref<const nlohmann::ordered_json::number_unsigned_t&>();
}

/// The number; null for one that is infinite or not a number, which JSON does not have.
inline nlohmann::ordered_json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace cairn::pipeline
