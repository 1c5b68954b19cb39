#include "stages/simulate/ray_caster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "stages/simulate/object_hierarchy.h"

namespace cairn::stages {
namespace {

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

/// Of a ray, in the frame of the target's object.
Vector3 origin_of(const Target& target, const Vector3* start) {
  return start == nullptr ? target.origin : target.in_frame(*start);
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

}  // namespace

RayCaster::RayCaster(const std::vector<SceneObject>& objects, const Vector3& origin)
    : hierarchy_(std::make_unique<ObjectHierarchy>(objects, origin, meet_piece)) {}

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
  rtcIntersect1(hierarchy_->scene(), &cast.context, &ray);
  const Candidate& best = cast.best;
  if (best.object == kNone) return std::nullopt;
  const Target& target = hierarchy_->target(best.object);
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
