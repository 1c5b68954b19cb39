// How far places are from the surfaces of a scene.
#pragma once

#include <memory>
#include <vector>

#include "stages/simulate/scene.h"

namespace cairn::stages {

class ObjectHierarchy;

/// Distances from the nearest surface of all objects, whether a ray could get there or not, so also inside others. The
/// hierarchy of bounding boxes only chooses candidates; distances are computed by the shapes, in double.
class SurfaceDistance {
 public:
  /// At least one object; they must outlive it. Throws as ObjectHierarchy does.
  explicit SurfaceDistance(const std::vector<SceneObject>& objects);
  ~SurfaceDistance();
  SurfaceDistance(const SurfaceDistance&) = delete;
  SurfaceDistance& operator=(const SurfaceDistance&) = delete;

  /// Of a place in the world. Any thread.
  double distance(const Vector3& place) const;

 private:
  Vector3 origin_;
  std::unique_ptr<ObjectHierarchy> hierarchy_;
};

}  // namespace cairn::stages
