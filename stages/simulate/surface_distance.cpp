// Based on: Embree's point queries (rtcPointQuery), which visit boxes within a radius that the call-back shrinks.
#include "stages/simulate/surface_distance.h"

#include <embree3/rtcore.h>

#include <limits>

#include "formats/error.h"
#include "stages/simulate/object_hierarchy.h"

namespace cairn::stages {
namespace {

struct Query {
  const ObjectHierarchy& hierarchy;
  Vector3 place;  ///< from the hierarchy's origin
  double nearest = std::numeric_limits<double>::infinity();

  /// Boxes are that of floats, so is the place: what may be as near as the nearest must still be looked into.
  float radius() const { return rounded_up(nearest + kWiden * (length(place) + nearest)); }
};

bool ask_piece(RTCPointQueryFunctionArguments* arguments) {
  Query& query = *static_cast<Query*>(arguments->userPtr);
  const Target& target = query.hierarchy.target(arguments->geomID);
  const double distance =
      target.object->shape->distance(arguments->primID, target.in_frame(query.place));
  if (!(distance < query.nearest)) return false;
  query.nearest = distance;
  arguments->query->radius = query.radius();
  return true;
}

/// The middle of all objects: there floats are the finest.
Vector3 middle_of(const std::vector<SceneObject>& objects) {
  CAIRN_CHECK(!objects.empty());
  Box box;
  for (const SceneObject& object : objects) box.add(object.pose.translation);
  return (box.min + box.max) * 0.5;
}

}  // namespace

SurfaceDistance::SurfaceDistance(const std::vector<SceneObject>& objects)
    : origin_(middle_of(objects)),
      hierarchy_(std::make_unique<ObjectHierarchy>(objects, origin_, nullptr)) {}

SurfaceDistance::~SurfaceDistance() = default;

double SurfaceDistance::distance(const Vector3& place) const {
  Query query{.hierarchy = *hierarchy_, .place = place - origin_};
  RTCPointQuery at{};
  at.x = static_cast<float>(query.place[0]);
  at.y = static_cast<float>(query.place[1]);
  at.z = static_cast<float>(query.place[2]);
  at.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(hierarchy_->scene(), &at, &context, ask_piece, &query);
  return query.nearest;
}

}  // namespace cairn::stages
