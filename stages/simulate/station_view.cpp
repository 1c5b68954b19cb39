#include "stages/simulate/station_view.h"

namespace cairn::stages {

StationView::StationView(const std::vector<SceneObject>& objects, const Station& station,
                         const StationEffects& effects)
    : station_(station),
      effects_(effects),
      pose_(station.pose()),
      to_station_(formats::transposed(pose_.linear)) {
  divide(objects);
  caster_ = std::make_unique<RayCaster>(still_, station.position);
  if (!leafy_.empty()) foliage_ = std::make_unique<CrossingCaster>(leafy_, station.position);
}

void StationView::divide(const std::vector<SceneObject>& objects) {
  for (const SceneObject& object : objects) {
    if (effects_.passes_foliage() && object.leaf_area_density > 0)
      leafy_.push_back(object);
    else if (effects_.moves_objects() && object.walk != Vector3{})
      movers_.push_back(std::make_unique<Mover>(object, station_.position));
    else
      still_.push_back(object);
  }
}

std::vector<Crossing> StationView::foliage(const Vector3& direction) const {
  if (!foliage_) return {};
  return foliage_->cast(formats::multiply(pose_.linear, direction), station_.max_range);
}

void StationView::look_at_movers(std::uint64_t ray, const Vector3& in_world,
                                 std::optional<Hit>& hit) const {
  const double time =
      effects_.time_of(static_cast<double>(ray) / static_cast<double>(station_.raster.rays()));
  for (const auto& mover : movers_) {
    // The object stays in its hierarchy, and the scanner moves the other way.
    const Vector3 elsewhere = displacement(mover->object.front(), time) * -1;
    const auto other = mover->caster.cast(in_world, station_.max_range, &elsewhere);
    if (other && (!hit || other->distance < hit->distance)) hit = other;
  }
}

}  // namespace cairn::stages
