// What the benchmarks that are programs of their own share.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <string_view>
#include <vector>

namespace cairn::bench {

inline double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A line: the median of some values, at least one, with the least and the greatest.
inline void print_spread(std::string_view name, std::vector<double> values, std::string_view unit) {
  std::sort(values.begin(), values.end());
  fmt::print("{:<32} {:8.2f} ({:.2f} to {:.2f}) {}\n", name, values[values.size() / 2],
             values.front(), values.back(), unit);
}

}  // namespace cairn::bench
