// Embree's hierarchy of bounding boxes over the pieces of all objects.
// Based on: Ingo Wald et al., "Embree: a kernel framework for efficient CPU ray tracing", ACM TOG 2014. Every
// shape is a user geometry: Embree sorts bounding boxes, which are widened by more than single precision can
// lose, and hands candidates back.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/simulate/scene.h"

// Embree's, whose header only sources include.
struct RTCDeviceTy;
struct RTCSceneTy;
struct RTCIntersectFunctionNArguments;

namespace cairn::stages {

/// Share of a coordinate by which boxes are widened: several units of the last digit of a float.
inline constexpr double kWiden = 0x1p-20;

float rounded_down(double value);
float rounded_up(double value);

/// One object as seen from the origin of the hierarchy.
struct Target {
  const SceneObject* object;
  std::array<Vector3, 3> to_object;  ///< rotation from world axes to the object's
  Vector3 origin;                    ///< of the hierarchy, in the object's frame
  Box extent;

  /// A place, from the origin in world axes, in the object's frame.
  Vector3 in_frame(const Vector3& place) const {
    return origin + formats::multiply(to_object, place);
  }
};

class ObjectHierarchy {
 public:
  using Intersect = void (*)(const RTCIntersectFunctionNArguments*);

  /// Boxes, in single precision, are as seen from `origin`. `objects` must outlive it; the numbers of Embree's
  /// geometries are theirs, and their user data are the targets. `intersect` may be null if no rays are cast. Uses
  /// the threads of the arena that it is called in. Throws std::bad_alloc, and Error (kInvariant) if it cannot be
  /// built for another reason.
  ObjectHierarchy(const std::vector<SceneObject>& objects, const Vector3& origin,
                  Intersect intersect);
  ~ObjectHierarchy();
  ObjectHierarchy(const ObjectHierarchy&) = delete;
  ObjectHierarchy& operator=(const ObjectHierarchy&) = delete;

  const Target& target(std::uint32_t object) const { return targets_[object]; }
  RTCSceneTy* scene() const { return scene_; }

 private:
  void add(std::uint32_t id, Intersect intersect);
  void build(Intersect intersect);
  void release();

  std::vector<Target> targets_;
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace cairn::stages
