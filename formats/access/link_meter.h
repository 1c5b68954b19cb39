// How much should be under way over a link, from how fast it is and how long answers take.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace cairn::formats {

/// Answers that are under way share the link. With too few it rests between them; with too many each takes so long that
/// what is wanted has changed before it is whole, and what has become urgent waits behind them. Under way should be what
/// fills the link until the next answer begins, and twice that, so that a faster link shows itself.
class LinkMeter {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint64_t kLeast = 128 << 10, kMost = 16 << 20;
  /// Until an answer has told better.
  static constexpr std::chrono::milliseconds kUsualLatency{100};
  /// That the thread takes to ask for more.
  static constexpr std::chrono::milliseconds kPause{20};

  void add(std::uint64_t bytes) { bytes_ += bytes; }
  /// From a request to the first byte of its answer. The least counts: others stood behind answers that were under way.
  void add_latency(std::chrono::microseconds latency);
  /// To be called often; `busy`: something is under way.
  void tick(Clock::time_point now, bool busy);
  std::uint64_t bytes_under_way() const;

 private:
  std::optional<Clock::time_point> since_;
  std::uint64_t bytes_ = 0;
  double bytes_per_s_ = 0;
  std::optional<std::chrono::microseconds> latency_;
};

}  // namespace cairn::formats
