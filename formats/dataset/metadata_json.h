// How metadata.json is read: with bounds on what a hostile one may do.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string_view>

#include "formats/error.h"

namespace cairn::formats {

/// Parses a metadata text: nested at most 64 deep, without numbers that no double holds.
[[nodiscard]] std::optional<DecodeError> parse_metadata(std::string_view text,
                                                        nlohmann::ordered_json& json);

/// The value at a path of keys, if it is a whole number that is not negative.
std::optional<std::uint64_t> number_at(const nlohmann::ordered_json& json,
                                       std::initializer_list<std::string_view> path);

}  // namespace cairn::formats
