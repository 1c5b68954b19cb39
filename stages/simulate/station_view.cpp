#include "stages/simulate/station_view.h"

#include <algorithm>

namespace cairn::stages {

StationView::StationView(const std::vector<SceneObject>& objects, const Station& station,
                         const StationEffects& effects)
    : station_(station),
      effects_(effects),
      pose_(station.pose()),
      to_station_(formats::transposed(pose_.linear)) {
  if (effects.moves_objects()) divide(objects);
  caster_ =
      std::make_unique<RayCaster>(effects.moves_objects() ? still_ : objects, station.position);
}

void StationView::divide(const std::vector<SceneObject>& objects) {
  for (const SceneObject& object : objects) {
    if (object.walk == Vector3{})
      still_.push_back(object);
    else
      movers_.push_back(std::make_unique<Mover>(object, station_.position));
  }
}

std::optional<Echo> StationView::look(std::uint64_t ray, const Vector3& direction,
                                      double from) const {
  const Vector3 in_world = formats::multiply(pose_.linear, direction);
  const Vector3 start = in_world * from;
  auto hit = caster_->cast(in_world, station_.max_range - from, start);
  if (!movers_.empty()) look_at_movers(ray, in_world, start, hit);
  if (!hit) return std::nullopt;
  const double cosine = std::clamp(-dot(hit->normal, in_world), 0.0, 1.0);
  return Echo{.distance = hit->distance + from,
              .incidence_cosine = cosine,
              .normal = formats::multiply(to_station_, hit->normal),
              .surface = hit->color,
              .object = hit->object,
              .number = 0,
              .energy = 1,
              .range = hit->distance + from,
              .direction = direction,
              .intensity = cosine,
              .color = hit->color};
}

void StationView::look_at_movers(std::uint64_t ray, const Vector3& in_world, const Vector3& start,
                                 std::optional<Hit>& hit) const {
  const double time =
      effects_.time_of(static_cast<double>(ray) / static_cast<double>(station_.raster.rays()));
  const double reach = station_.max_range - length(start);
  for (const auto& mover : movers_) {
    // The object stays in its hierarchy, and the scanner moves the other way.
    const Vector3 moved = displacement(mover->object.front(), time);
    const auto other = mover->caster.cast(in_world, reach, start - moved);
    if (other && (!hit || other->distance < hit->distance)) hit = other;
  }
}

}  // namespace cairn::stages
