// What a station sees of a scene, as ideal echoes.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "stages/simulate/effects/station_effects.h"
#include "stages/simulate/ray_caster.h"

namespace cairn::stages {

class StationView final : public Sight {
 public:
  /// All must outlive the view. Uses the threads of the arena that it is called in. Throws as RayCaster does.
  StationView(const std::vector<SceneObject>& objects, const Station& station,
              const StationEffects& effects);

  std::optional<Echo> look(std::uint64_t ray, const Vector3& direction,
                           double from = 0) const override;

 private:
  /// One object alone, so that it can be where it is at the time of a ray.
  struct Mover {
    Mover(const SceneObject& moved, const Vector3& origin)
        : object{moved}, caster(object, origin) {}
    std::vector<SceneObject> object;
    RayCaster caster;
  };
  void divide(const std::vector<SceneObject>& objects);
  void look_at_movers(std::uint64_t ray, const Vector3& in_world, const Vector3& start,
                      std::optional<Hit>& hit) const;

  const Station& station_;
  const StationEffects& effects_;
  formats::Pose pose_;
  std::array<Vector3, 3> to_station_;  ///< rotation from world axes to the station's
  std::vector<SceneObject> still_;     ///< if some objects move
  std::vector<std::unique_ptr<Mover>> movers_;
  std::unique_ptr<RayCaster> caster_;  ///< of all that stands still
};

// Here, so that it is compiled into the loop over rays: handing an echo out takes a good part of making it.
inline std::optional<Echo> StationView::look(std::uint64_t ray, const Vector3& direction,
                                             double from) const {
  const Vector3 in_world = formats::multiply(pose_.linear, direction);
  const Vector3 start = in_world * from;
  auto hit = caster_->cast(in_world, station_.max_range - from, from > 0 ? &start : nullptr);
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

}  // namespace cairn::stages
