#include "stages/simulate/station_view.h"

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

void StationView::look_at_movers(std::uint64_t ray, const Vector3& in_world, const Vector3& start,
                                 std::optional<Hit>& hit) const {
  const double time =
      effects_.time_of(static_cast<double>(ray) / static_cast<double>(station_.raster.rays()));
  const double reach = station_.max_range - length(start);
  for (const auto& mover : movers_) {
    // The object stays in its hierarchy, and the scanner moves the other way.
    const Vector3 moved = displacement(mover->object.front(), time);
    const Vector3 elsewhere = start - moved;
    const auto other = mover->caster.cast(in_world, reach, &elsewhere);
    if (other && (!hit || other->distance < hit->distance)) hit = other;
  }
}

}  // namespace cairn::stages
