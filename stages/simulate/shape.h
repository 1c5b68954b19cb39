// Surfaces that rays can hit, each in a frame of its own and made of pieces that a bounding volume hierarchy
// sorts. All arithmetic is in double: a hit lies on the surface to about 1e-15 of its coordinates.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "formats/meshes/mesh.h"
#include "stages/simulate/vector.h"

namespace cairn::stages {

struct Ray {
  Vector3 origin;
  Vector3 direction;  ///< of length 1
};

struct Box {
  Vector3 min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
              std::numeric_limits<double>::infinity()};
  Vector3 max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
              -std::numeric_limits<double>::infinity()};

  void add(const Vector3& point);
};

inline constexpr double kNoHit = std::numeric_limits<double>::infinity();

class Shape {
 public:
  virtual ~Shape() = default;

  /// At least 1 and fewer than 2^32. No piece reaches beyond its bounds.
  virtual std::size_t pieces() const = 0;
  virtual Box bounds(std::size_t piece) const = 0;

  /// The least distance above 0 at which the ray meets this piece, or kNoHit. Any thread; throws nothing.
  virtual double intersect(std::size_t piece, const Ray& ray) const = 0;

  /// Unit normal of the piece at a point on it; of a closed shape it looks outwards.
  virtual Vector3 normal(std::size_t piece, const Vector3& point) const = 0;

  /// Distance of a point from the surface of this piece, from the inside of a closed one too. Any thread.
  virtual double distance(std::size_t piece, const Vector3& point) const = 0;

  Box whole() const;
};

/// A stretch of a ray, by distance; empty if it ends before it begins.
struct RayStretch {
  double begin = -kNoHit;
  double end = kNoHit;

  void cut(const RayStretch& other) {
    begin = std::max(begin, other.begin);
    end = std::min(end, other.end);
  }
  /// Where a ray from 0 on first meets the skin of the solid that this stretch lies in.
  double first_hit() const {
    if (!(begin <= end) || !(end > 0)) return kNoHit;
    return begin > 0 ? begin : end;
  }
};

/// A shape that a straight line is in for one stretch at most.
class ConvexSolid : public Shape {
 public:
  std::size_t pieces() const final { return 1; }
  double intersect(std::size_t, const Ray& ray) const final { return inside(ray).first_hit(); }

  /// Of the ray's line, also before its origin. Any thread; throws nothing.
  virtual RayStretch inside(const Ray& ray) const = 0;
};

/// All lengths are above 0, and all shapes are centred on the origin unless said otherwise.
using ShapePtr = std::shared_ptr<const Shape>;
ShapePtr make_plane(double width, double depth);  ///< a rectangle in x and y; its normal is z
ShapePtr make_box(const Vector3& size);
ShapePtr make_sphere(double radius);
ShapePtr make_cylinder(double radius, double height);  ///< along z, with both lids
/// All points within `radius` of the line through at least two `points`: wires, rails, branches.
ShapePtr make_tube(const std::vector<Vector3>& points, double radius);
/// Triangles with flat normals, that of the corners' anticlockwise order. Two that share an edge leave no gap.
ShapePtr make_mesh(formats::Mesh mesh);

}  // namespace cairn::stages
