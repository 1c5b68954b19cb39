#include "stages/simulate/ray_caster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "formats/error.h"
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

RTCRayHit ray_from(const Vector3& origin, const Vector3& direction, double max_range) {
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin[0]);
  ray.ray.org_y = static_cast<float>(origin[1]);
  ray.ray.org_z = static_cast<float>(origin[2]);
  ray.ray.dir_x = static_cast<float>(direction[0]);
  ray.ray.dir_y = static_cast<float>(direction[1]);
  ray.ray.dir_z = static_cast<float>(direction[2]);
  ray.ray.tfar = rounded_up(max_range);
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

/// As Cast, for all that a ray crosses.
struct CrossingCast {
  RTCIntersectContext context;
  Vector3 direction;
  double max_range;
  std::vector<std::pair<unsigned, Crossing>> found;  ///< by Embree's number of the geometry
};

void cross_solid(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const auto& target = *static_cast<const Target*>(arguments->geometryUserPtr);
  CrossingCast& cast = *reinterpret_cast<CrossingCast*>(arguments->context);
  const auto& solid = static_cast<const ConvexSolid&>(*target.object->shape);
  const RayStretch inside =
      solid.inside({target.origin, formats::multiply(target.to_object, cast.direction)});
  const double begin = std::max(0.0, inside.begin);
  if (begin < inside.end && begin < cast.max_range)
    cast.found.emplace_back(arguments->geomID, Crossing{begin, inside.end, target.object});
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
  RTCRayHit ray = ray_from(start == nullptr ? Vector3{} : *start, direction, max_range);
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

CrossingCaster::CrossingCaster(const std::vector<SceneObject>& objects, const Vector3& origin)
    : hierarchy_(std::make_unique<ObjectHierarchy>(objects, origin, cross_solid)) {
  for (const SceneObject& object : objects)
    CAIRN_CHECK(dynamic_cast<const ConvexSolid*>(object.shape.get()) != nullptr);
}

CrossingCaster::~CrossingCaster() = default;

std::vector<Crossing> CrossingCaster::cast(const Vector3& direction, double max_range) const {
  CrossingCast cast{.context = {}, .direction = direction, .max_range = max_range, .found = {}};
  rtcInitIntersectContext(&cast.context);
  RTCRayHit ray = ray_from({}, direction, max_range);
  rtcIntersect1(hierarchy_->scene(), &cast.context, &ray);
  // In an order that does not depend on the hierarchy; each geometry is one piece.
  std::ranges::sort(cast.found, {}, &std::pair<unsigned, Crossing>::first);
  std::vector<Crossing> crossings;
  crossings.reserve(cast.found.size());
  for (const auto& [number, crossing] : cast.found) crossings.push_back(crossing);
  return crossings;
}

}  // namespace cairn::stages
