// How datasets behind a network are read, and what that took.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stop_token>

namespace cairn::formats {

struct AccessOptions {
  /// Where fetched bytes are kept for later runs; empty: nowhere.
  std::filesystem::path cache_folder{};
  bool must_cache = true;  ///< without it, a folder that cannot be made is none
  std::uint64_t cache_bytes = std::uint64_t{1} << 30;  ///< of that folder, at most
  /// Of what was fetched and is not used yet, or was used last.
  std::uint64_t memory_bytes = std::uint64_t{64} << 20;
  unsigned connections = 8;  ///< and requests under way, at most
  std::chrono::milliseconds connect_timeout{10'000};
  std::chrono::seconds stall_timeout{15};  ///< without a hundred bytes a second
  /// Failures one after the other after which a request is given up.
  unsigned attempts = 6;
  std::chrono::milliseconds first_delay{
      250};  ///< before the second attempt; doubled for each further one
  std::chrono::milliseconds longest_delay{10'000};
  /// Ends waiting, by Stopped.
  std::stop_token stop{};
  /// Asked several times a second by every thread that waits: whether this wait is to end, by Stopped. Others go on.
  std::function<bool()> interrupted{};
};

/// Where bytes are kept unless told otherwise: cairn in $XDG_CACHE_HOME, or in ~/.cache; empty if neither is known.
std::filesystem::path default_cache_folder();

/// Counted since the dataset was opened. All are 0 on a disk.
struct AccessStatistics {
  std::uint64_t requests = 0;       ///< sent, retries too
  std::uint64_t retries = 0;        ///< of these after a failure
  std::uint64_t fetched_bytes = 0;  ///< that came in answers' bodies
  std::uint64_t gap_bytes =
      0;  ///< of these between the ranges asked for, fetched to spare requests
  std::uint64_t repeated_bytes = 0;  ///< of these fetched again, for what came first was damaged
  std::uint64_t cache_hits = 0;      ///< ranges found in the cache's folder
  std::uint64_t cache_bytes = 0;     ///< in these

  friend bool operator==(const AccessStatistics&, const AccessStatistics&) = default;
};

}  // namespace cairn::formats
