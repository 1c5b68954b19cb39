#include "viewer/window/frame_clock.h"

#include <algorithm>
#include <numeric>

namespace cairn::viewer {

void FrameClock::tick(double now, bool rested) {
  const double step = now - last_;
  last_ = now;
  step_s_ = rested ? 0 : std::clamp(step, 0.0, 0.25);
  if (!rested) steps_[count_++ % kFrames] = step;
}

double FrameClock::frames_per_s() const {
  const double seconds = std::accumulate(steps_.begin(), steps_.end(), 0.0);
  return seconds > 0 ? static_cast<double>(std::min(count_, kFrames)) / seconds : 0;
}

}  // namespace cairn::viewer
