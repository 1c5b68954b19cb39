// A camera's path through a scene: cameras at stated times, and what lies between them. It is recorded in the window and
// replayed frame by frame, so that a picture series or a measurement can be repeated.
//
// Based on: Catmull, Rom, "A Class of Local Interpolating Splines", 1974, with the times as knots, so that the camera's
// speed has no jumps. Where it departs: after Fritsch, Carlson, "Monotone Piecewise Cubic Interpolation", 1980, the speed
// at a keyframe is at most three times that of the slower side. So the path does not swing out where the sides differ
// much, and between two equal cameras it rests.
#pragma once

#include <vector>

#include "viewer/camera.h"

namespace cairn::viewer {

struct TimedCamera {
  double time_s = 0;
  Camera camera;

  friend bool operator==(const TimedCamera&, const TimedCamera&) = default;
};

class Walk {
 public:
  static constexpr double kMostFramesPerSecond = 1000;
  static constexpr double kMostFrames = 1'000'000;  ///< from the start to the end

  /// Throws Error (kUsage), naming the camera by its number from 1, unless there is a camera, each is valid (fault_of),
  /// times are finite, at least 0 and increase, frames a second are above 0 and at most kMostFramesPerSecond, and
  /// all frames at most kMostFrames.
  explicit Walk(std::vector<TimedCamera> keyframes, double frames_per_second = 30);

  const std::vector<TimedCamera>& keyframes() const { return keyframes_; }
  double frames_per_second() const { return frames_per_second_; }
  /// From time 0 to the last keyframe. Until the first one the camera rests.
  double duration_s() const { return keyframes_.back().time_s; }

  /// The camera at a time, which is brought into 0 to duration_s(). Eye, target and up follow the spline, the field of
  /// view changes evenly. Always a valid camera: where what lies between is none, such as an eye that passes through its
  /// target, it is that of the keyframe before.
  Camera at(double time_s) const;

  /// The cameras at times 0, 1/f, 2/f and so on, as far as the walk lasts; at least one. Throws Error (kUsage) for
  /// frames a second as the constructor does.
  std::vector<TimedCamera> frames(double frames_per_second) const;

 private:
  std::vector<TimedCamera> keyframes_;
  double frames_per_second_;
};

/// A way around a vertical axis, looking at its center.
struct Orbit {
  glm::dvec3 center{0, 0, 0};
  double radius = 1;    ///< of the circle, world units; above 0
  double height = 0;    ///< of the eye above the center
  double seconds = 10;  ///< above 0
  double turns = 1;  ///< counter-clockwise, seen from above; negative the other way; at most 1000
  double start_degrees = -90;  ///< from the x axis to the y axis
  double fov_y_degrees = 50;
};

/// Keyframes along the orbit, at least 36 a turn. Throws Error (kUsage) for what is not as told above.
Walk orbit_walk(const Orbit& orbit, double frames_per_second = 30);

}  // namespace cairn::viewer
