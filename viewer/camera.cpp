#include "viewer/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

double radians(double degrees) { return degrees * (std::numbers::pi / 180); }

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The unit vector of a finite vector that is not zero, however long or short.
glm::dvec3 unit(const glm::dvec3& v) {
  const double largest = std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
  return glm::normalize(v / largest);
}

/// Sine of the least angle between the line of sight and the up direction: with less, rounding decides what is right
/// and left in the picture.
constexpr double kLeastSine = 1e-6;

void check_camera(const Camera& camera) {
  if (std::string fault = fault_of(camera); !fault.empty()) formats::throw_usage(std::move(fault));
}

}  // namespace

std::string fault_of(const Camera& camera) {
  if (!finite(camera.eye) || !finite(camera.target) || !finite(camera.up) ||
      !std::isfinite(camera.fov_y_degrees))
    return "a camera with a number that is not finite";
  if (!(camera.fov_y_degrees > 0 && camera.fov_y_degrees < 180))
    return fmt::format("a camera's field of view is {} degrees, expected above 0 and below 180",
                       camera.fov_y_degrees);
  if (camera.eye == camera.target) return "a camera whose eye is its target";
  const glm::dvec3 sight = camera.target - camera.eye;
  if (!finite(sight)) return "a camera whose target is too far from its eye";
  if (camera.up == glm::dvec3(0)) return "a camera whose up direction is zero";
  if (!(glm::length(glm::cross(unit(sight), unit(camera.up))) > kLeastSine))
    return "a camera that looks along its up direction";
  return {};
}

View::View(const Camera& camera, PictureSize size, double near)
    : camera_(camera), size_(size), near_(near) {
  check_camera(camera);
  CAIRN_CHECK(size.width > 0 && size.height > 0 && near > 0);
  forward_ = unit(camera.target - camera.eye);
  right_ = glm::normalize(glm::cross(forward_, unit(camera.up)));
  up_ = glm::cross(right_, forward_);
  const double tan_y = std::tan(radians(camera.fov_y_degrees) / 2);
  const double tan_x = tan_y * size.width / size.height;
  focal_ = size.height / 2.0 / tan_y;
  corner_ = std::sqrt(1 + tan_x * tan_x + tan_y * tan_y);
  side_planes_[0] = glm::normalize(right_ + tan_x * forward_);
  side_planes_[1] = glm::normalize(-right_ + tan_x * forward_);
  side_planes_[2] = glm::normalize(up_ + tan_y * forward_);
  side_planes_[3] = glm::normalize(-up_ + tan_y * forward_);
}

double View::nearest_depth(const Box& box) const {
  return glm::dot(box.center - eye(), forward_) - glm::dot(box.half, glm::abs(forward_));
}

double View::distance(const Box& box) const {
  const glm::dvec3 beyond = glm::max(glm::abs(box.center - eye()) - box.half, glm::dvec3(0));
  return glm::length(beyond);
}

bool View::may_see(const Box& box, double reach) const {
  const glm::dvec3 center = box.center - eye();
  // Rounding must not hide a box that touches a plane.
  const double slack = reach + 1e-12 * (glm::length(center) + glm::length(box.half));
  for (const glm::dvec3& plane : side_planes_)
    if (glm::dot(center, plane) + glm::dot(box.half, glm::abs(plane)) < -slack) return false;
  return glm::dot(center, forward_) + glm::dot(box.half, glm::abs(forward_)) >= near_ - slack;
}

bool View::sees_all_of(const Box& box) const {
  const glm::dvec3 center = box.center - eye();
  for (const glm::dvec3& plane : side_planes_)
    if (glm::dot(center, plane) < glm::dot(box.half, glm::abs(plane))) return false;
  return nearest_depth(box) >= near_;
}

bool View::faces_away(const Box& box, const Cone& cone) const {
  if (cone.axis == glm::vec3(0) || cone.min_cosine <= 0) return false;
  const glm::dvec3 axis(cone.axis);
  const glm::dvec3 center = box.center - eye();
  const double along = glm::dot(center, axis);
  if (along <= 0) return false;  // most that face the eye
  const double distance = glm::length(center);
  const double radius = glm::length(box.half);
  if (distance <= radius) return false;
  // Angles add up: of a normal to the axis, of the axis to the line of sight through the center, and of that to any
  // line of sight through the box. Away means that all together stay below a right angle.
  const double to_normal = std::acos(std::clamp(double{cone.min_cosine}, -1.0, 1.0));
  const double to_axis = std::acos(std::min(along / (distance * glm::length(axis)), 1.0));
  const double to_sight = std::asin(radius / distance);
  return to_normal + to_axis + to_sight < std::numbers::pi / 2 - 1e-6;
}

double View::pixel_bound(const Box& box, double length) const {
  if (length == 0) return 0;
  const double depth = std::max(nearest_depth(box), near_) - length;
  if (!(depth >= near_)) return std::numeric_limits<double>::infinity();
  return focal_ * length * corner_ / depth;
}

glm::dvec2 View::project(const glm::dvec3& from_eye) const {
  const double scale = focal_ / glm::dot(from_eye, forward_);
  return {size_.width / 2.0 + glm::dot(from_eye, right_) * scale,
          size_.height / 2.0 - glm::dot(from_eye, up_) * scale};
}

View View::widened(double share) const {
  // Both sides grow by the same factor, which keeps the picture's proportions: the vertical angle tells both.
  Camera camera = camera_;
  const double tan_y = std::tan(radians(camera_.fov_y_degrees) / 2) * (1 + 2 * share);
  camera.fov_y_degrees =
      std::min(2 * std::atan(tan_y) * (180 / std::numbers::pi), std::nextafter(180.0, 0.0));
  return {camera, size_, near_};
}

glm::dvec3 direction_around(const Box& box) {
  const double rise = box.half.z < 0.3 * std::max(box.half.x, box.half.y) ? 0.7 : 0.3;
  return {-0.55, -1.0, rise};
}

Camera camera_around(const Box& box, PictureSize size) {
  return camera_facing(box, direction_around(box), size);
}

Camera camera_facing(const Box& box, const glm::dvec3& direction, PictureSize size) {
  constexpr double kShareOfPicture = 0.95;
  Camera camera;
  camera.target = box.center;
  const glm::dvec3 back = glm::normalize(direction);
  const glm::dvec3 right = glm::normalize(glm::cross(-back, camera.up));
  const glm::dvec3 up = glm::cross(back, right);
  const double tan_y = std::tan(radians(camera.fov_y_degrees) / 2) * kShareOfPicture;
  const double tan_x = tan_y * size.width / size.height;
  // A corner c is in a picture whose middle lies s to the right of the center if |c . right - s| <= tan (d - c . back):
  // d >= a - s / tan and d >= b + s / tan, with a and b the greatest of c . back +- c . right / tan. Upwards likewise.
  double a[2] = {0, 0};
  double b[2] = {0, 0};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 c =
        box.half * glm::dvec3((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                              (corner & 4) != 0 ? 1 : -1);
    const double aside[2] = {glm::dot(c, right) / tan_x, glm::dot(c, up) / tan_y};
    for (int i = 0; i < 2; ++i) {
      a[i] = std::max(a[i], glm::dot(c, back) + aside[i]);
      b[i] = std::max(b[i], glm::dot(c, back) - aside[i]);
    }
  }
  camera.target += right * (tan_x * (a[0] - b[0]) / 2) + up * (tan_y * (a[1] - b[1]) / 2);
  const double distance = std::max((a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
  camera.eye = camera.target + back * std::max(distance, 1e-9 * (1 + glm::length(box.center)));
  return camera;
}

Camera parse_camera(std::string_view text) {
  std::vector<double> numbers;
  std::size_t parts = 0;
  const auto refuse = [&]() -> Camera {
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "a camera",
         .found = "'" + std::string(text) + "'",
         .expected = "auto or ex,ey,ez/tx,ty,tz[/ux,uy,uz[/fov]]: eye, target, up in world "
                     "coordinates, vertical field of view in degrees"});
  };
  constexpr std::size_t kNumbers[] = {3, 3, 3, 1};
  for (std::size_t at = 0; at <= text.size(); ++parts) {
    if (parts == std::size(kNumbers)) return refuse();
    const std::size_t end = std::min(text.find('/', at), text.size());
    const std::string_view part = text.substr(at, end - at);
    std::size_t count = 0;
    for (std::size_t from = 0; from <= part.size(); ++count) {
      const std::size_t comma = std::min(part.find(',', from), part.size());
      double number = 0;
      const char* last = part.data() + comma;
      const auto [end_of_number, error] = std::from_chars(part.data() + from, last, number);
      if (error != std::errc{} || end_of_number != last) return refuse();
      numbers.push_back(number);
      from = comma + 1;
    }
    if (count != kNumbers[parts]) return refuse();
    at = end + 1;
  }
  if (parts < 2) return refuse();
  Camera camera;
  camera.eye = {numbers[0], numbers[1], numbers[2]};
  camera.target = {numbers[3], numbers[4], numbers[5]};
  if (parts > 2) camera.up = {numbers[6], numbers[7], numbers[8]};
  if (parts > 3) camera.fov_y_degrees = numbers[9];
  check_camera(camera);
  return camera;
}

}  // namespace cairn::viewer
