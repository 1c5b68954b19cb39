// Records where a camera goes, as a walk that can be replayed.
#pragma once

#include <optional>
#include <vector>

#include "viewer/walk.h"

namespace cairn::viewer {

class WalkRecorder {
 public:
  /// Between keyframes, seconds.
  static constexpr double kInterval = 0.25;

  bool recording() const { return start_.has_value(); }
  /// Drops what was recorded and begins at this time, seconds of any clock.
  void start(double now, const Camera& camera);
  /// Tells where the camera is; it is kept if the last keyframe is long enough ago. Does nothing
  /// while not recording.
  void note(double now, const Camera& camera);
  /// Ends with this camera. Requires recording(). Throws Error (kUsage) for a walk of more frames
  /// than Walk has.
  Walk finish(double now, const Camera& camera);

 private:
  std::optional<double> start_;
  std::vector<TimedCamera> keyframes_;
};

}  // namespace cairn::viewer
