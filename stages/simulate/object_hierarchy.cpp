#include "stages/simulate/object_hierarchy.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>

#include "formats/error.h"

namespace cairn::stages {
namespace {

void put_bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& target = *static_cast<const Target*>(arguments->geometryUserPtr);
  const Box own = target.object->shape->bounds(arguments->primID);
  const Vector3 centre = (own.min + own.max) * 0.5 - target.origin;
  const Vector3 half = (own.max - own.min) * 0.5;
  const auto& to_world = target.object->pose.linear;
  Vector3 middle = formats::multiply(to_world, centre), reach{};
  double farthest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < 3; ++i) reach[axis] += std::fabs(to_world[axis][i]) * half[i];
    farthest = std::max(farthest, std::fabs(middle[axis]) + reach[axis]);
  }
  reach = reach + Vector3{1, 1, 1} * (farthest * kWiden);
  RTCBounds& bounds = *arguments->bounds_o;
  bounds.lower_x = rounded_down(middle[0] - reach[0]);
  bounds.lower_y = rounded_down(middle[1] - reach[1]);
  bounds.lower_z = rounded_down(middle[2] - reach[2]);
  bounds.upper_x = rounded_up(middle[0] + reach[0]);
  bounds.upper_y = rounded_up(middle[1] + reach[1]);
  bounds.upper_z = rounded_up(middle[2] + reach[2]);
}

/// Errors of all calls since the last time; those that follow from a missing object are told by it.
void refuse_any_error(RTCDevice device) {
  const RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (code != RTC_ERROR_NONE)
    throw formats::Error(
        formats::ErrorKind::kInvariant,
        {.what = "Embree cannot build its hierarchy: error " + std::to_string(code)});
}

}  // namespace

float rounded_down(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafterf(rounded, -std::numeric_limits<float>::infinity())
                         : rounded;
}
float rounded_up(double value) { return -rounded_down(-value); }

void ObjectHierarchy::add(std::uint32_t id, Intersect intersect) {
  const Target& target = targets_[id];
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
  refuse_any_error(device_);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(target.object->shape->pieces()));
  // Embree asks for a pointer that is not const; the call-backs only read.
  rtcSetGeometryUserData(geometry, const_cast<Target*>(&target));
  rtcSetGeometryBoundsFunction(geometry, put_bounds, nullptr);
  if (intersect != nullptr) rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene_, geometry, id);
  rtcReleaseGeometry(geometry);
}

ObjectHierarchy::ObjectHierarchy(const std::vector<SceneObject>& objects, const Vector3& origin,
                                 Intersect intersect) {
  for (const SceneObject& object : objects) {
    const auto to_object = formats::transposed(object.pose.linear);
    targets_.push_back({&object, to_object,
                        formats::multiply(to_object, origin - object.pose.translation),
                        object.shape->whole()});
  }
  try {
    build(intersect);
  } catch (...) {
    release();
    throw;
  }
}

ObjectHierarchy::~ObjectHierarchy() { release(); }

void ObjectHierarchy::release() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

void ObjectHierarchy::build(Intersect intersect) {
  // No configuration of the user's or of the folder that the program runs in shall change a result.
  device_ = rtcNewDevice("ignore_config_files=1");
  refuse_any_error(device_);  // of no device: why there is none
  scene_ = rtcNewScene(device_);
  refuse_any_error(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  for (std::uint32_t id = 0; id < targets_.size(); ++id) add(id, intersect);
  rtcCommitScene(scene_);
  refuse_any_error(device_);
}

}  // namespace cairn::stages
