// Finds what a ray from one place hits first.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stages/simulate/scene.h"

namespace cairn::stages {

class ObjectHierarchy;

/// What a ray hit, in world axes.
struct Hit {
  double distance = kNoHit;
  const SceneObject* object = nullptr;
  Vector3 normal{};  ///< of length 1, facing the origin of the ray
  Rgb color{};
};

/// What of a ray lies in an object.
struct Crossing {
  double begin, end;  ///< 0 <= begin < end
  const SceneObject* object;
};

/// Rays from one origin. The hierarchy of bounding boxes, in single precision, is built around that origin and
/// only chooses candidates; hits are computed by the shapes, in double and in the objects' own frames, so their
/// digits do not depend on where in the world they are. Of several pieces at the same distance the first in the
/// order of objects and pieces counts, whatever the hierarchy looks like.
class RayCaster {
 public:
  /// `objects` must outlive the caster. Uses the threads of the arena that it is called in. Throws
  /// std::bad_alloc, and Error (kInvariant) if the hierarchy cannot be built for another reason.
  RayCaster(const std::vector<SceneObject>& objects, const Vector3& origin);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// The nearest hit no farther than `max_range` along a direction of length 1, in world axes, of a ray that starts
  /// at `start` from the origin, or there if that is nullptr. (Candidates are chosen to about 1e-7 of that way.) Any
  /// thread.
  std::optional<Hit> cast(const Vector3& direction, double max_range,
                          const Vector3* start = nullptr) const;

 private:
  std::unique_ptr<ObjectHierarchy> hierarchy_;
};

/// Rays from one origin through objects, all of them, whatever lies before them. Requires that they are ConvexSolids.
class CrossingCaster {
 public:
  /// As RayCaster.
  CrossingCaster(const std::vector<SceneObject>& objects, const Vector3& origin);
  ~CrossingCaster();
  CrossingCaster(const CrossingCaster&) = delete;
  CrossingCaster& operator=(const CrossingCaster&) = delete;

  /// The crossings of a ray from the origin that begin before `max_range`, in the order of the objects. Any thread.
  std::vector<Crossing> cast(const Vector3& direction, double max_range) const;

 private:
  std::unique_ptr<ObjectHierarchy> hierarchy_;
};

}  // namespace cairn::stages
