#include "pipeline/point_count.h"

#include <charconv>
#include <cmath>

namespace cairn::pipeline {

std::optional<std::uint64_t> parse_count(std::string_view text) {
  if (text == "all") return kAllPoints;
  double number = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc{}) return std::nullopt;
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  const double factor = unit.empty() ? 1 : unit == "k" || unit == "K" ? 1e3 : unit == "M" ? 1e6 : 0;
  const double count = number * factor;
  if (!(count >= 1 && count <= 1e15)) return std::nullopt;
  return static_cast<std::uint64_t>(std::llround(count));
}

}  // namespace cairn::pipeline
