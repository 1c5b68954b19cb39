// Shapes with a closed formula. Each ray is first moved to the point nearest to the shape's centre or axis, so
// that thin and far things keep their digits.
#include <algorithm>
#include <array>
#include <cmath>

#include "formats/error.h"
#include "stages/simulate/shape.h"

namespace cairn::stages {
namespace {

constexpr RayStretch kNothing{kNoHit, -kNoHit};

/// Where |origin + t * direction| <= half, along one axis.
RayStretch slab(double origin, double direction, double half) {
  if (direction == 0) return std::fabs(origin) <= half ? RayStretch{} : kNothing;
  const double a = (-half - origin) / direction;
  const double b = (half - origin) / direction;
  return {std::min(a, b), std::max(a, b)};
}

/// Where origin + t * direction is within `radius` of 0; `direction` need not have length 1.
RayStretch ball(const Vector3& origin, const Vector3& direction, double radius) {
  const double squared = dot(direction, direction);
  if (squared == 0) return dot(origin, origin) <= radius * radius ? RayStretch{} : kNothing;
  const double nearest = -dot(origin, direction) / squared;
  const Vector3 q = origin + direction * nearest;
  const double rest = radius * radius - dot(q, q);
  if (!(rest >= 0)) return kNothing;
  const double half = std::sqrt(rest / squared);
  return {nearest - half, nearest + half};
}

/// From the skin of a solid, by how far outside (above 0) or inside a point is of the slabs, or the like, that it is
/// the common part of, at right angles to each other.
template <std::size_t Count>
double skin_distance(const std::array<double, Count>& outside) {
  double square = 0, least_inside = -kNoHit;
  for (const double o : outside) {
    if (o > 0) square += o * o;
    least_inside = std::max(least_inside, o);
  }
  return square > 0 ? std::sqrt(square) : std::max(0.0, -least_inside);
}

Vector3 flat(const Vector3& v) { return {v[0], v[1], 0}; }

class Plane final : public Shape {
 public:
  Plane(double width, double depth) : half_{width / 2, depth / 2, 0} {}
  std::size_t pieces() const override { return 1; }
  Box bounds(std::size_t) const override { return {half_ * -1, half_}; }
  double intersect(std::size_t, const Ray& ray) const override {
    const double t = -ray.origin[2] / ray.direction[2];
    if (!(t > 0) || !(t < kNoHit)) return kNoHit;
    const Vector3 p = ray.origin + ray.direction * t;
    return std::fabs(p[0]) <= half_[0] && std::fabs(p[1]) <= half_[1] ? t : kNoHit;
  }
  Vector3 normal(std::size_t, const Vector3&) const override { return {0, 0, 1}; }
  double distance(std::size_t, const Vector3& point) const override {
    return length({std::max(0.0, std::fabs(point[0]) - half_[0]),
                   std::max(0.0, std::fabs(point[1]) - half_[1]), point[2]});
  }

 private:
  Vector3 half_;
};

class Cuboid final : public ConvexSolid {
 public:
  explicit Cuboid(const Vector3& size) : half_(size * 0.5) {}
  Box bounds(std::size_t) const override { return {half_ * -1, half_}; }
  RayStretch inside(const Ray& ray) const override {
    RayStretch stretch;
    for (std::size_t axis = 0; axis < 3; ++axis)
      stretch.cut(slab(ray.origin[axis], ray.direction[axis], half_[axis]));
    return stretch;
  }
  Vector3 normal(std::size_t, const Vector3& point) const override {
    std::size_t face = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
      if (std::fabs(point[axis]) - half_[axis] > std::fabs(point[face]) - half_[face]) face = axis;
    Vector3 outwards{};
    outwards[face] = point[face] < 0 ? -1 : 1;
    return outwards;
  }
  double distance(std::size_t, const Vector3& point) const override {
    return skin_distance<3>({std::fabs(point[0]) - half_[0], std::fabs(point[1]) - half_[1],
                             std::fabs(point[2]) - half_[2]});
  }

 private:
  Vector3 half_;
};

class Sphere final : public ConvexSolid {
 public:
  explicit Sphere(double radius) : radius_(radius) {}
  Box bounds(std::size_t) const override {
    return {{-radius_, -radius_, -radius_}, {radius_, radius_, radius_}};
  }
  RayStretch inside(const Ray& ray) const override {
    return ball(ray.origin, ray.direction, radius_);
  }
  Vector3 normal(std::size_t, const Vector3& point) const override { return normalised(point); }
  double distance(std::size_t, const Vector3& point) const override {
    return std::fabs(length(point) - radius_);
  }

 private:
  double radius_;
};

class Cylinder final : public ConvexSolid {
 public:
  Cylinder(double radius, double height) : radius_(radius), half_(height / 2) {}
  Box bounds(std::size_t) const override {
    return {{-radius_, -radius_, -half_}, {radius_, radius_, half_}};
  }
  RayStretch inside(const Ray& ray) const override {
    RayStretch stretch = ball(flat(ray.origin), flat(ray.direction), radius_);
    stretch.cut(slab(ray.origin[2], ray.direction[2], half_));
    return stretch;
  }
  Vector3 normal(std::size_t, const Vector3& point) const override {
    const Vector3 outwards = flat(point);
    if (std::fabs(point[2]) - half_ > length(outwards) - radius_)
      return {0, 0, point[2] < 0 ? -1.0 : 1.0};
    return normalised(outwards);
  }
  double distance(std::size_t, const Vector3& point) const override {
    return skin_distance<2>({length(flat(point)) - radius_, std::fabs(point[2]) - half_});
  }

 private:
  double radius_;
  double half_;
};

/// A chain of capsules, one piece each: a cylinder between two points and a ball around each of them.
class Tube final : public Shape {
 public:
  Tube(const std::vector<Vector3>& points, double radius) : radius_(radius) {
    CAIRN_CHECK(points.size() >= 2);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vector3 along = points[i] - points[i - 1];
      segments_.push_back({points[i - 1], normalised(along), length(along)});
    }
  }
  std::size_t pieces() const override { return segments_.size(); }
  Box bounds(std::size_t piece) const override {
    const Segment& segment = segments_[piece];
    const Vector3 reach{radius_, radius_, radius_};
    Box box;
    for (const double s : {0.0, segment.length})
      for (const double sign : {-1.0, 1.0})
        box.add(segment.from + segment.along * s + reach * sign);
    return box;
  }
  double intersect(std::size_t piece, const Ray& ray) const override {
    const Segment& segment = segments_[piece];
    const Vector3 origin = ray.origin - segment.from;
    const double from = dot(origin, segment.along), speed = dot(ray.direction, segment.along);
    const RayStretch side =
        ball(origin - segment.along * from, ray.direction - segment.along * speed, radius_);
    double nearest = kNoHit;
    // A hit counts where the skin is that of the side, or of one of the two balls.
    const auto offer = [&](double t, double low, double high) {
      const double s = from + t * speed;
      if (t > 0 && t < nearest && s >= low && s <= high) nearest = t;
    };
    for (const double t : {side.begin, side.end}) offer(t, 0, segment.length);
    for (const double end : {0.0, segment.length}) {
      const RayStretch cap = ball(origin - segment.along * end, ray.direction, radius_);
      for (const double t : {cap.begin, cap.end})
        offer(t, end == 0 ? -kNoHit : segment.length, end == 0 ? 0 : kNoHit);
    }
    return nearest;
  }
  Vector3 normal(std::size_t piece, const Vector3& point) const override {
    return normalised(from_axis(segments_[piece], point));
  }
  /// Of the whole tube, as pieces reach into each other. From inside a bend it may be less than it is.
  double distance(std::size_t, const Vector3& point) const override {
    double nearest = kNoHit;
    for (const Segment& segment : segments_)
      nearest = std::min(nearest, length(from_axis(segment, point)));
    return std::fabs(nearest - radius_);
  }

 private:
  struct Segment {
    Vector3 from;
    Vector3 along;  ///< of length 1
    double length;
  };
  /// From the nearest point of the segment.
  static Vector3 from_axis(const Segment& segment, const Vector3& point) {
    const Vector3 p = point - segment.from;
    return p - segment.along * std::clamp(dot(p, segment.along), 0.0, segment.length);
  }

  std::vector<Segment> segments_;
  double radius_;
};

}  // namespace

void Box::add(const Vector3& point) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    min[axis] = std::min(min[axis], point[axis]);
    max[axis] = std::max(max[axis], point[axis]);
  }
}

Box Shape::whole() const {
  Box box;
  for (std::size_t piece = 0; piece < pieces(); ++piece) {
    const Box part = bounds(piece);
    box.add(part.min);
    box.add(part.max);
  }
  return box;
}

ShapePtr make_plane(double width, double depth) { return std::make_shared<Plane>(width, depth); }
ShapePtr make_box(const Vector3& size) { return std::make_shared<Cuboid>(size); }
ShapePtr make_sphere(double radius) { return std::make_shared<Sphere>(radius); }
ShapePtr make_cylinder(double radius, double height) {
  return std::make_shared<Cylinder>(radius, height);
}
ShapePtr make_tube(const std::vector<Vector3>& points, double radius) {
  return std::make_shared<Tube>(points, radius);
}

}  // namespace cairn::stages
