#include "viewer/window/walk_recorder.h"

#include <utility>

#include "formats/error.h"

namespace cairn::viewer {

void WalkRecorder::start(double now, const Camera& camera) {
  start_ = now;
  keyframes_ = {{0, camera}};
}

void WalkRecorder::note(double now, const Camera& camera) {
  if (!start_) return;
  const double time_s = now - *start_;
  if (time_s >= keyframes_.back().time_s + kInterval) keyframes_.push_back({time_s, camera});
}

Walk WalkRecorder::finish(double now, const Camera& camera) {
  CAIRN_CHECK(start_.has_value());
  const double time_s = now - *start_;
  if (time_s > keyframes_.back().time_s) keyframes_.push_back({time_s, camera});
  start_.reset();
  return Walk(std::exchange(keyframes_, {}));
}

}  // namespace cairn::viewer
