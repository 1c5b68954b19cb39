// A figure in a robe, procedural: a closed, smooth, bumpy surface that is known exactly everywhere.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/simulate/shape.h"

namespace cairn::stages {

/// The surface is where a field is 0; the field is negative inside. It is the smooth union of cones with round
/// ends (limbs, robe, head), less two lattices of sine waves (folds and grain). Each of its parts changes no faster
/// than distance, so the whole changes no faster than kSteepest times distance, and a ray that goes on by
/// field / kSteepest jumps over nothing. The pieces are the cells of a regular grid that the surface may pass
/// through.
class Statue final : public Shape {
 public:
  /// Stands on z = 0 at the origin, `height` high, and looks along x.
  explicit Statue(double height);

  std::size_t pieces() const override { return cells_.size(); }
  Box bounds(std::size_t piece) const override;
  double intersect(std::size_t piece, const Ray& ray) const override;
  Vector3 normal(std::size_t piece, const Vector3& point) const override;
  /// Of a place on the surface to which the way from the piece's box leads towards the point: never less than the
  /// distance from the surface, and that itself where the point is nearer than the folds and the grain are narrow.
  double distance(std::size_t piece, const Vector3& point) const override;

  /// In units of length, by the definition above.
  double field(const Vector3& point) const { return height_ * value(point * (1 / height_), kAll); }
  static double steepest();

 private:
  using Parts = std::uint32_t;  ///< a bit for each cone that matters
  static constexpr Parts kAll = ~Parts{0};
  struct Cell {
    std::uint32_t x, y, z;
    Parts parts;
  };

  double value(const Vector3& p, Parts parts) const;
  Vector3 gradient(const Vector3& p, Parts parts) const;
  /// Where the field turns from positive to negative on the ray between two distances, or kNoHit.
  double first_root(const Ray& ray, double begin, double end, Parts parts) const;
  Vector3 onto_surface(Vector3 p) const;
  void find_cells();

  double height_;
  std::vector<Cell> cells_;
};

}  // namespace cairn::stages
