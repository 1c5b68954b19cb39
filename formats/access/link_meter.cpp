#include "formats/access/link_meter.h"

#include <algorithm>

namespace cairn::formats {
namespace {

constexpr std::chrono::milliseconds kWindow{200};

}  // namespace

void LinkMeter::add_latency(std::chrono::microseconds latency) {
  if (latency.count() > 0) latency_ = std::min(latency_.value_or(latency), latency);
}

void LinkMeter::tick(Clock::time_point now, bool busy) {
  if (!busy) {
    since_.reset();
    bytes_ = 0;
    return;
  }
  if (!since_) since_ = now;
  if (now - *since_ < kWindow) return;
  const double rate =
      static_cast<double>(bytes_) / std::chrono::duration<double>(now - *since_).count();
  // A faster link is believed at once, a slower one may be a passing moment.
  bytes_per_s_ = std::max(rate, 0.5 * (bytes_per_s_ + rate));
  since_ = now;
  bytes_ = 0;
}

std::uint64_t LinkMeter::bytes_under_way() const {
  const std::chrono::duration<double> time = 2 * latency_.value_or(kUsualLatency) + kPause;
  return static_cast<std::uint64_t>(std::clamp(
      time.count() * bytes_per_s_, static_cast<double>(kLeast), static_cast<double>(kMost)));
}

}  // namespace cairn::formats
