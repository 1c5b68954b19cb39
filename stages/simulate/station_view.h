// What a station sees of a scene, as ideal echoes.
#pragma once

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

}  // namespace cairn::stages
