#include "viewer/camera_controls.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// The picture's axes; the size and the near plane have no part in them.
View axes_of(const Camera& camera) { return {camera, {}, 1}; }

/// A vector turned about `up` by `azimuth`, counter-clockwise as seen from its tip, and by `fall` away from it.
/// `up` and `side` are unit vectors, and side is at right angles to both up and the vector.
glm::dvec3 swung(const glm::dvec3& vector, const glm::dvec3& up, const glm::dvec3& side,
                 double azimuth, double fall) {
  const double length = glm::length(vector);
  const double angle = std::acos(std::clamp(glm::dot(vector, up) / length, -1.0, 1.0));
  const double least = std::min(kPoleMargin, angle);
  const double most = std::max(std::numbers::pi - kPoleMargin, angle);
  const double fallen = std::clamp(angle + fall, least, most);
  // The horizontal direction below the vector, turned in the plane at right angles to up.
  const glm::dvec3 level = glm::cross(side, up);
  const glm::dvec3 outward = glm::dot(level, vector) < 0 ? -level : level;
  const glm::dvec3 toward =
      outward * std::cos(azimuth) + glm::cross(up, outward) * std::sin(azimuth);
  return length * (up * std::cos(fallen) + toward * std::sin(fallen));
}

glm::dvec3 unit_up(const Camera& camera) {
  const glm::dvec3 size = glm::abs(camera.up);
  return glm::normalize(camera.up / std::max({size.x, size.y, size.z}));
}

/// The camera after a move, or that before it if the move ends at none.
Camera valid(const Camera& before, const glm::dvec3& eye, const glm::dvec3& target) {
  Camera after = before;
  after.eye = eye;
  after.target = target;
  return fault_of(after).empty() ? after : before;
}

}  // namespace

Camera orbited(const Camera& camera, const glm::dvec2& drag, PictureSize size) {
  const View view = axes_of(camera);
  const double rate = std::numbers::pi / size.height;
  const glm::dvec3 offset = swung(camera.eye - camera.target, unit_up(camera), view.right(),
                                  -drag.x * rate, -drag.y * rate);
  return valid(camera, camera.target + offset, camera.target);
}

Camera turned(const Camera& camera, const glm::dvec2& move, PictureSize size) {
  const View view = axes_of(camera);
  const double rate = camera.fov_y_degrees * (std::numbers::pi / 180) / size.height;
  const glm::dvec3 sight = swung(camera.target - camera.eye, unit_up(camera), view.right(),
                                 -move.x * rate, move.y * rate);
  return valid(camera, camera.eye, camera.eye + sight);
}

Camera zoomed(const Camera& camera, double factor) {
  CAIRN_CHECK(std::isfinite(factor) && factor > 0);
  const glm::dvec3 offset = camera.eye - camera.target;
  const double distance = glm::length(offset);
  const glm::dvec3 size = glm::abs(camera.target);
  const double least = std::max(1e-12, 1e-10 * std::max({size.x, size.y, size.z}));
  // What is beyond a limit already may stay, but goes no farther.
  const double wanted =
      std::clamp(distance * factor, std::min(least, distance), std::max(1e15, distance));
  return valid(camera, camera.target + offset * (wanted / distance), camera.target);
}

Camera panned(const Camera& camera, const glm::dvec2& from, const glm::dvec2& to,
              PictureSize size) {
  const View view(camera, size, 1);
  const double world_per_pixel = glm::length(camera.target - camera.eye) / view.focal_pixels();
  const glm::dvec2 by = (to - from) * world_per_pixel;
  const glm::dvec3 shift = view.up() * by.y - view.right() * by.x;
  return valid(camera, camera.eye + shift, camera.target + shift);
}

Camera flown(const Camera& camera, const glm::dvec3& along, double distance) {
  const View view = axes_of(camera);
  const glm::dvec3 steps = along / std::max(1.0, glm::length(along)) * distance;
  const glm::dvec3 shift = view.right() * steps.x + view.up() * steps.y + view.forward() * steps.z;
  return valid(camera, camera.eye + shift, camera.target + shift);
}

double fly_speed(const glm::dvec3& eye, const Box& scene) {
  const glm::dvec3 beyond = glm::max(glm::abs(eye - scene.center) - scene.half, glm::dvec3(0));
  return std::max(0.5 * glm::length(beyond), 0.05 * glm::length(scene.half));
}

}  // namespace cairn::viewer
