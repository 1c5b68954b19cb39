// Numbers of points as people write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace cairn::pipeline {

inline constexpr std::uint64_t kAllPoints = UINT64_MAX;

/// "3M", "65k", "1.5M", "250000", or "all" for kAllPoints; nothing for what is none of these, or no point.
std::optional<std::uint64_t> parse_count(std::string_view text);

}  // namespace cairn::pipeline
