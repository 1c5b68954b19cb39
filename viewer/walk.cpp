#include "viewer/walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

using Keyframes = std::vector<TimedCamera>;
using Quantity = glm::dvec3 Camera::*;

/// The speed at a keyframe against that of the slower side; see the head of walk.h.
constexpr double kSpeedRatio = 3;

void check_rate(double frames_per_second, double duration_s) {
  if (!(frames_per_second > 0 && frames_per_second <= Walk::kMostFramesPerSecond))
    formats::throw_usage(
        fmt::format("frames a second of a walk: found {}, expected above 0 and at most {}",
                    frames_per_second, Walk::kMostFramesPerSecond));
  if (!(duration_s * frames_per_second <= Walk::kMostFrames))
    formats::throw_usage(
        fmt::format("a walk of {} seconds at {} frames a second: expected at most {} frames",
                    duration_s, frames_per_second, Walk::kMostFrames));
}

/// Mean velocity from keyframe i to the next.
glm::dvec3 chord(const Keyframes& keys, std::size_t i, Quantity quantity) {
  return (keys[i + 1].camera.*quantity - keys[i].camera.*quantity) /
         (keys[i + 1].time_s - keys[i].time_s);
}

glm::dvec3 shortened(const glm::dvec3& velocity, double most) {
  const double length = glm::length(velocity);
  return length > most ? velocity * (most / length) : velocity;
}

/// At an inner keyframe the velocity of the parabola through it and its neighbours, as far as it is not too fast.
glm::dvec3 inner_velocity(const Keyframes& keys, std::size_t i, Quantity quantity) {
  const double before = keys[i].time_s - keys[i - 1].time_s;
  const double after = keys[i + 1].time_s - keys[i].time_s;
  const glm::dvec3 arriving = chord(keys, i - 1, quantity), leaving = chord(keys, i, quantity);
  return shortened((arriving * after + leaving * before) / (before + after),
                   kSpeedRatio * std::min(glm::length(arriving), glm::length(leaving)));
}

/// The velocity at keyframe i. An outer part of the walk is a parabola, unless that would begin or end backwards.
glm::dvec3 velocity_at(const Keyframes& keys, std::size_t i, Quantity quantity) {
  const std::size_t last = keys.size() - 1;
  if (i > 0 && i < last) return inner_velocity(keys, i, quantity);
  const glm::dvec3 side = chord(keys, i == 0 ? 0 : last - 1, quantity);
  if (last == 1) return side;
  const glm::dvec3 outer = 2.0 * side - inner_velocity(keys, i == 0 ? 1 : last - 1, quantity);
  if (glm::dot(outer, side) <= 0) return glm::dvec3(0);
  return shortened(outer, kSpeedRatio * glm::length(side));
}

/// Cubic of Hermite from keyframe i to the next, at share u of the way.
glm::dvec3 between(const Keyframes& keys, std::size_t i, double u, Quantity quantity) {
  const double step = keys[i + 1].time_s - keys[i].time_s;
  const glm::dvec3& from = keys[i].camera.*quantity;
  const glm::dvec3& to = keys[i + 1].camera.*quantity;
  return from + (u * u * (3 - 2 * u)) * (to - from) +
         (u * (1 - u) * (1 - u) * step) * velocity_at(keys, i, quantity) -
         (u * u * (1 - u) * step) * velocity_at(keys, i + 1, quantity);
}

}  // namespace

Walk::Walk(std::vector<TimedCamera> keyframes, double frames_per_second)
    : keyframes_(std::move(keyframes)), frames_per_second_(frames_per_second) {
  if (keyframes_.empty()) formats::throw_usage("a walk without a camera");
  double before = -1;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const auto& [time_s, camera] = keyframes_[i];
    if (!(std::isfinite(time_s) && time_s >= 0 && time_s > before))
      formats::throw_usage(fmt::format("camera {}: time: found {}, expected {}", i + 1, time_s,
                                       i == 0 ? "at least 0" : fmt::format("above {}", before)));
    if (const std::string fault = fault_of(camera); !fault.empty())
      formats::throw_usage(fmt::format("camera {}: {}", i + 1, fault));
    before = time_s;
  }
  check_rate(frames_per_second_, duration_s());
}

Camera Walk::at(double time_s) const {
  const auto next =
      std::upper_bound(keyframes_.begin(), keyframes_.end(), time_s,
                       [](double time, const TimedCamera& key) { return time < key.time_s; });
  if (next == keyframes_.begin()) return keyframes_.front().camera;
  const TimedCamera& key = *(next - 1);
  if (next == keyframes_.end() || key.time_s == time_s) return key.camera;
  const auto i = static_cast<std::size_t>(next - keyframes_.begin()) - 1;
  const double u = (time_s - key.time_s) / (next->time_s - key.time_s);
  const double fov = key.camera.fov_y_degrees;
  const Camera camera{.eye = between(keyframes_, i, u, &Camera::eye),
                      .target = between(keyframes_, i, u, &Camera::target),
                      .up = between(keyframes_, i, u, &Camera::up),
                      .fov_y_degrees = fov + u * (next->camera.fov_y_degrees - fov)};
  return fault_of(camera).empty() ? camera : key.camera;
}

std::vector<TimedCamera> Walk::frames(double frames_per_second) const {
  check_rate(frames_per_second, duration_s());
  // A last frame that rounding puts behind the end is still one of the walk.
  const double steps = std::floor(duration_s() * frames_per_second * (1 + 1e-12));
  std::vector<TimedCamera> frames;
  for (double i = 0; i <= steps; ++i) {
    const double time_s = std::min(i / frames_per_second, duration_s());
    frames.push_back({time_s, at(time_s)});
  }
  return frames;
}

Walk orbit_walk(const Orbit& orbit, double frames_per_second) {
  constexpr double kPerTurn = 36, kMostTurns = 1000;
  if (!(orbit.radius > 0)) formats::throw_usage("an orbit whose radius is not above 0");
  if (!(orbit.seconds > 0)) formats::throw_usage("an orbit whose seconds are not above 0");
  if (!(std::fabs(orbit.turns) <= kMostTurns))
    formats::throw_usage(fmt::format("an orbit of more than {} turns", kMostTurns));
  const double steps = std::max(1.0, std::ceil(std::fabs(orbit.turns) * kPerTurn));
  std::vector<TimedCamera> keyframes;
  for (double i = 0; i <= steps; ++i) {
    const double share = i / steps;
    const double angle = orbit.start_degrees * (std::numbers::pi / 180) +
                         share * orbit.turns * (2 * std::numbers::pi);
    const glm::dvec3 from_center(orbit.radius * std::cos(angle), orbit.radius * std::sin(angle),
                                 orbit.height);
    keyframes.push_back({.time_s = share * orbit.seconds,
                         .camera = {.eye = orbit.center + from_center,
                                    .target = orbit.center,
                                    .fov_y_degrees = orbit.fov_y_degrees}});
  }
  return Walk(std::move(keyframes), frames_per_second);
}

}  // namespace cairn::viewer
