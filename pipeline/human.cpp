#include "pipeline/human.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace cairn::pipeline {

std::string with_commas(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, 1, ',');
  return text;
}

std::string human_bytes(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kUnits{"bytes", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1024 && unit + 1 < kUnits.size(); ++unit) value /= 1024;
  return unit == 0 ? fmt::format("{} bytes", bytes)
                   : fmt::format("{:.{}f} {}", value, value < 100 ? 1 : 0, kUnits[unit]);
}

std::string human_rate(double points_per_s) {
  if (points_per_s >= 1e6)
    return fmt::format("{:.{}f} M points/s", points_per_s / 1e6, points_per_s < 1e8 ? 1 : 0);
  if (points_per_s >= 1e3) return fmt::format("{:.0f} k points/s", points_per_s / 1e3);
  return fmt::format("{:.0f} points/s", points_per_s);
}

std::string human_duration(double seconds) {
  if (seconds < 10) return fmt::format("{:.2f} s", seconds);
  if (seconds < 99.95) return fmt::format("{:.1f} s", seconds);
  return clock_duration(seconds);
}

std::string clock_duration(double seconds) {
  if (!(seconds < 1e9)) return "ages";
  const auto whole = static_cast<std::uint64_t>(std::llround(std::max(seconds, 0.0)));
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string significant(double value, int digits) { return fmt::format("{:.{}g}", value, digits); }

std::string count_of(std::uint64_t count, const char* noun) {
  return with_commas(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string printable(std::string text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool c1 =
        byte(i) == 0xc2 && i + 1 < text.size() && byte(i + 1) >= 0x80 && byte(i + 1) < 0xa0;
    if (c1) text.erase(i, 1);
    if (c1 || byte(i) < 0x20 || byte(i) == 0x7f) text[i] = '?';
  }
  return text;
}

}  // namespace cairn::pipeline
