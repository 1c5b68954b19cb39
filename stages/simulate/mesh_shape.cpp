// Triangle meshes as shapes. Whether a ray passes inside an edge is decided by the sign of a triple product of
// the edge's ends, computed from them alone, so the two triangles on its sides always decide against each other
// and no ray slips through between them.
// Based on: Sven Woop, Carsten Benthin, Ingo Wald, "Watertight Ray/Triangle Intersection", JCGT 2013; here with
// triple products in double instead of a sheared frame in single precision.
#include <algorithm>
#include <cmath>
#include <utility>

#include "stages/simulate/shape.h"

namespace cairn::stages {
namespace {

class TriangleMesh final : public Shape {
 public:
  explicit TriangleMesh(formats::Mesh mesh) : mesh_(std::move(mesh)) {}
  std::size_t pieces() const override { return mesh_.triangles.size(); }
  Box bounds(std::size_t piece) const override {
    Box box;
    for (const std::uint32_t corner : mesh_.triangles[piece]) box.add(mesh_.vertices[corner]);
    return box;
  }
  double intersect(std::size_t piece, const Ray& ray) const override {
    const auto& corners = mesh_.triangles[piece];
    const Vector3 a = mesh_.vertices[corners[0]] - ray.origin;
    const Vector3 b = mesh_.vertices[corners[1]] - ray.origin;
    const Vector3 c = mesh_.vertices[corners[2]] - ray.origin;
    const double u = dot(ray.direction, cross(c, b));
    const double v = dot(ray.direction, cross(a, c));
    const double w = dot(ray.direction, cross(b, a));
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return kNoHit;
    const Vector3 across = cross(b - a, c - a);
    const double t = dot(a, across) / dot(ray.direction, across);
    return t > 0 && t < kNoHit ? t : kNoHit;  // not a number where the ray lies in the plane
  }
  Vector3 normal(std::size_t piece, const Vector3&) const override {
    const auto& corners = mesh_.triangles[piece];
    const Vector3& a = mesh_.vertices[corners[0]];
    return normalised(cross(mesh_.vertices[corners[1]] - a, mesh_.vertices[corners[2]] - a));
  }

  /// From the foot of the perpendicular, where that lies inside all edges; else from the nearest edge.
  double distance(std::size_t piece, const Vector3& point) const override {
    const auto& corners = mesh_.triangles[piece];
    const Vector3& a = mesh_.vertices[corners[0]];
    const Vector3 across = cross(mesh_.vertices[corners[1]] - a, mesh_.vertices[corners[2]] - a);
    bool inside = dot(across, across) > 0;
    double nearest = kNoHit;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3& from = mesh_.vertices[corners[i]];
      const Vector3 edge = mesh_.vertices[corners[(i + 1) % 3]] - from, p = point - from;
      inside = inside && dot(cross(across, edge), p) >= 0;
      const double size = dot(edge, edge);
      const double along = size > 0 ? std::clamp(dot(p, edge) / size, 0.0, 1.0) : 0;
      nearest = std::min(nearest, length(p - edge * along));
    }
    return inside ? std::fabs(dot(point - a, across)) / length(across) : nearest;
  }

 private:
  formats::Mesh mesh_;
};

}  // namespace

ShapePtr make_mesh(formats::Mesh mesh) { return std::make_shared<TriangleMesh>(std::move(mesh)); }

}  // namespace cairn::stages
