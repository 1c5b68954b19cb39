// What the thread that fetches knows beside the table of ranges: one request with its retries, and fronts as the disk keeps
// them.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/access/access_options.h"
#include "formats/access/byte_source.h"
#include "formats/access/http_answer.h"
#include "formats/access/range_table.h"

namespace cairn::formats {

/// Ranges that are fetched as one. What has come is kept over failures: the next attempt asks for the rest.
struct FetchJob {
  using Clock = std::chrono::steady_clock;

  std::uint64_t number = 0;
  std::vector<RangeKey> keys;       ///< in ascending order
  std::size_t delivered = 0;        ///< of them
  std::vector<std::byte> received;  ///< from the first key's offset on
  unsigned failures = 0;
  Clock::time_point first_failure{};
  bool again = false;       ///< no cache on the way may answer
  bool sent = false;        ///< under way, not waiting for `due`
  Clock::time_point due{};  ///< when to try again

  std::size_t file() const { return keys.front().file; }
  bool is_front() const { return keys.front().front; }
  std::uint64_t first() const { return keys.front().offset; }
  std::uint64_t end() const { return keys.back().end(); }
  /// Bytes that are still to come.
  std::uint64_t left_bytes() const { return end() - first() - received.size(); }
};

/// How long to wait before the next attempt, after so many failures (1 or more) and what the server asked for.
std::chrono::milliseconds retry_delay(const AccessOptions& options, unsigned failures,
                                      std::optional<std::chrono::seconds> retry_after);

/// Whether so many failures are too many: those are forgiven that brought bytes between them.
bool too_many_failures(const AccessOptions& options, unsigned failures,
                       std::uint64_t received_bytes);

/// A front that an earlier run kept, and the version that it is of.
struct StoredFront {
  Validators validators;
  std::uint64_t file_size_bytes = 0;
  SharedBytes bytes;
};

std::vector<std::byte> encode_front(const Validators& validators, std::uint64_t file_size_bytes,
                                    std::span<const std::byte> bytes);
/// Nothing for what is none.
std::optional<StoredFront> decode_front(std::span<const std::byte> bytes);

}  // namespace cairn::formats
