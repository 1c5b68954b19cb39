// How fast frames follow one another while they do.
#pragma once

#include <array>
#include <cstddef>

namespace cairn::viewer {

class FrameClock {
 public:
  /// A frame was shown at this time, seconds of any clock. `rested`: the window waited for events
  /// before it, so that the time since the last frame tells nothing.
  void tick(double now, bool rested);
  /// Frames a second over the last kFrames that followed one another; 0 before there are two.
  double frames_per_s() const;
  /// Seconds since the last frame before this one, at most a quarter: what a hand did in the
  /// meantime.
  double step_s() const { return step_s_; }

 private:
  static constexpr std::size_t kFrames = 20;

  double last_ = 0;
  double step_s_ = 0;
  std::array<double, kFrames> steps_{};
  std::size_t count_ = 0;
};

}  // namespace cairn::viewer
