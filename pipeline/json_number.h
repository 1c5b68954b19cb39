// Whole numbers of JSON texts that come from outside.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

namespace cairn::pipeline {

/// The number itself. Throws nlohmann's exception for any other value, where its own conversion would take all numbers, and
/// one that is out of range without a defined result.
inline std::uint64_t whole_number(const nlohmann::ordered_json& value) {
  return value.get_ref<const nlohmann::ordered_json::number_unsigned_t&>();
}

}  // namespace cairn::pipeline
