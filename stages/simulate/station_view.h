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

  std::optional<Echo> look(std::uint64_t ray, const Vector3& direction) const override;
  std::vector<Crossing> foliage(const Vector3& direction) const override;

 private:
  /// One object alone, so that it can be where it is at the time of a ray.
  struct Mover {
    Mover(const SceneObject& moved, const Vector3& origin)
        : object{moved}, caster(object, origin) {}
    std::vector<SceneObject> object;
    RayCaster caster;
  };
  void divide(const std::vector<SceneObject>& objects);
  void look_at_movers(std::uint64_t ray, const Vector3& in_world, std::optional<Hit>& hit) const;

  const Station& station_;
  const StationEffects& effects_;
  formats::Pose pose_;
  std::array<Vector3, 3> to_station_;  ///< rotation from world axes to the station's
  std::vector<SceneObject> still_;     ///< solid, and in one place
  std::vector<SceneObject> leafy_;     ///< that beams pass through
  std::vector<std::unique_ptr<Mover>> movers_;
  std::unique_ptr<RayCaster> caster_;  ///< of all that is still
  std::unique_ptr<CrossingCaster> foliage_;
};

// Here, so that it is compiled into the loop over rays: handing an echo out takes a good part of making it.
inline std::optional<Echo> StationView::look(std::uint64_t ray, const Vector3& direction) const {
  const Vector3 in_world = formats::multiply(pose_.linear, direction);
  auto hit = caster_->cast(in_world, station_.max_range);
  if (!movers_.empty()) look_at_movers(ray, in_world, hit);
  if (!hit) return std::nullopt;
  const double cosine = std::clamp(-dot(hit->normal, in_world), 0.0, 1.0);
  return Echo{.distance = hit->distance,
              .incidence_cosine = cosine,
              .normal = formats::multiply(to_station_, hit->normal),
              .surface = hit->color,
              .object = hit->object,
              .number = 0,
              .energy = 1,
              .range = hit->distance,
              .direction = direction,
              .intensity = cosine,
              .color = hit->color};
}

}  // namespace cairn::stages
