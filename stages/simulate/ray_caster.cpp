// Based on: Ingo Wald et al., "Embree: a kernel framework for efficient CPU ray tracing", ACM TOG 2014. Every
// shape is a user geometry: Embree sorts bounding boxes, which are widened by more than single precision can
// lose, and hands candidates back.
#include "stages/simulate/ray_caster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>

#include "formats/error.h"

namespace cairn::stages {
namespace {

/// Share of a coordinate by which boxes are widened: several units of the last digit of a float.
constexpr double kWiden = 0x1p-20;

/// One object as seen from the origin of the rays.
struct Target {
  const SceneObject* object;
  std::array<Vector3, 3> to_object;  ///< rotation from world axes to the object's
  Vector3 origin;                    ///< of the rays, in the object's frame
  Box extent;
};

struct Candidate {
  double distance;
  std::uint32_t object, piece;
};

/// What Embree hands through to the call-backs of one ray; the context comes first, as it asks for.
struct Cast {
  RTCIntersectContext context;
  Vector3 direction;
  const Vector3* start;  ///< from the origin of the hierarchy; nullptr: there
  Candidate best;
};

float rounded_down(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafterf(rounded, -std::numeric_limits<float>::infinity())
                         : rounded;
}
float rounded_up(double value) { return -rounded_down(-value); }

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

/// Of a ray, in the frame of the target's object.
Vector3 origin_of(const Target& target, const Vector3* start) {
  if (start == nullptr) return target.origin;
  return target.origin + formats::multiply(target.to_object, *start);
}

void meet_piece(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const auto& target = *static_cast<const Target*>(arguments->geometryUserPtr);
  Cast& cast = *reinterpret_cast<Cast*>(arguments->context);
  const Ray ray{origin_of(target, cast.start), formats::multiply(target.to_object, cast.direction)};
  const double distance = target.object->shape->intersect(arguments->primID, ray);
  Candidate& best = cast.best;
  if (!(distance <= best.distance)) return;
  const bool earlier = arguments->geomID < best.object ||
                       (arguments->geomID == best.object && arguments->primID < best.piece);
  if (distance == best.distance && !earlier) return;
  best.distance = distance;
  best.object = arguments->geomID;
  best.piece = arguments->primID;
  // Boxes that begin at this very distance must still be looked into.
  auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  ray_hit->ray.tfar = rounded_up(distance);
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

struct RayCaster::Hierarchy {
  std::vector<Target> targets;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Hierarchy() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  void add(std::uint32_t id);
};

void RayCaster::Hierarchy::add(std::uint32_t id) {
  const Target& target = targets[id];
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  refuse_any_error(device);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(target.object->shape->pieces()));
  // Embree asks for a pointer that is not const; the call-backs only read.
  rtcSetGeometryUserData(geometry, const_cast<Target*>(&target));
  rtcSetGeometryBoundsFunction(geometry, put_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, meet_piece);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RayCaster::RayCaster(const std::vector<SceneObject>& objects, const Vector3& origin)
    : hierarchy_(std::make_unique<Hierarchy>()) {
  Hierarchy& h = *hierarchy_;
  for (const SceneObject& object : objects) {
    const auto to_object = formats::transposed(object.pose.linear);
    h.targets.push_back({&object, to_object,
                         formats::multiply(to_object, origin - object.pose.translation),
                         object.shape->whole()});
  }
  // No configuration of the user's or of the folder that the program runs in shall change a result.
  h.device = rtcNewDevice("ignore_config_files=1");
  refuse_any_error(h.device);  // of no device: why there is none
  h.scene = rtcNewScene(h.device);
  refuse_any_error(h.device);
  rtcSetSceneFlags(h.scene, RTC_SCENE_FLAG_ROBUST);
  for (std::uint32_t id = 0; id < h.targets.size(); ++id) h.add(id);
  rtcCommitScene(h.scene);
  refuse_any_error(h.device);
}

RayCaster::~RayCaster() = default;

std::optional<Hit> RayCaster::cast(const Vector3& direction, double max_range,
                                   const Vector3* start) const {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  Cast cast{
      .context = {}, .direction = direction, .start = start, .best = {max_range, kNone, kNone}};
  rtcInitIntersectContext(&cast.context);
  RTCRayHit ray{};
  if (start != nullptr) {
    ray.ray.org_x = static_cast<float>((*start)[0]);
    ray.ray.org_y = static_cast<float>((*start)[1]);
    ray.ray.org_z = static_cast<float>((*start)[2]);
  }
  ray.ray.dir_x = static_cast<float>(direction[0]);
  ray.ray.dir_y = static_cast<float>(direction[1]);
  ray.ray.dir_z = static_cast<float>(direction[2]);
  ray.ray.tfar = rounded_up(max_range);
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(hierarchy_->scene, &cast.context, &ray);
  const Candidate& best = cast.best;
  if (best.object == kNone) return std::nullopt;
  const Target& target = hierarchy_->targets[best.object];
  const SceneObject& object = *target.object;
  const Vector3 along = formats::multiply(target.to_object, direction);
  const Vector3 point = origin_of(target, start) + along * best.distance;
  const Vector3 outwards = object.shape->normal(best.piece, point);
  return Hit{.distance = best.distance,
             .object = &object,
             .normal = formats::multiply(object.pose.linear,
                                         dot(outwards, along) > 0 ? outwards * -1 : outwards),
             .color = color_at(object.paint, target.extent, point, outwards)};
}

}  // namespace cairn::stages
