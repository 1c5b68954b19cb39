// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace cairn::pipeline {

std::string with_commas(std::uint64_t number);  ///< 186,850,683
std::string human_bytes(std::uint64_t bytes);   ///< 1.4 GiB
std::string human_rate(double points_per_s);    ///< 11.8 M points/s
std::string human_duration(double seconds);     ///< 0.42 s, 12.3 s, 4:05, 1:02:03
std::string clock_duration(double seconds);     ///< 0:07, 1:02:03: for a time that is yet to come
std::string significant(double value, int digits);  ///< shortest decimal text with that many digits
std::string count_of(std::uint64_t count, const char* noun);  ///< 1 scan, 2,000 scans

/// Text that may come from outside, fit for a terminal: control characters, C1 in UTF-8 too, become '?'.
std::string printable(std::string text);

}  // namespace cairn::pipeline
