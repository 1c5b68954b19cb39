// Based on: R. B. Rusu, "Semantic 3D Object Maps for Everyday Manipulation in Human Living Environments", 2009:
// the normal is the direction in which the neighbourhood varies least. As PCL's NormalEstimationOMP, which is what the tests
// and a benchmark compare with; that one finds neighbours over the whole cloud in memory and in float32, and solves the
// cubic with arc tangents and cosines, whose last bits differ between machines. Here are sums, products, fractions and
// roots alone.
#include "stages/estimate/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/error.h"

namespace cairn::stages {

using formats::GridPoint;

namespace {

using Vector = std::array<double, 3>;

/// Neighbours are on a line if they vary across it by no more than a millionth of what they vary along it: squared.
constexpr double kLine = 1e-12;

/// The variation of a neighbourhood: a symmetric matrix, none of whose eigenvalues is negative.
struct Covariance {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  double trace() const { return xx + yy + zz; }
  /// Sum of the products of two eigenvalues, and product of all.
  double minors() const { return (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz); }
  double determinant() const {
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  }
};

/// Of the neighbours around the first one, in units of the distance of the last.
Covariance covariance_of(const formats::Grid& grid, std::span<const Neighbor> neighbors) {
  const GridPoint& origin = neighbors.front().position;
  const double size = std::sqrt(neighbors.back().squared_distance);
  const Vector scale{grid.step[0] / size, grid.step[1] / size, grid.step[2] / size};
  Vector sum{};
  Covariance squares;
  for (const Neighbor& neighbor : neighbors) {
    Vector d;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      d[axis] = scale[axis] * (double{1} * neighbor.position[axis] - origin[axis]);
      sum[axis] += d[axis];
    }
    squares.xx += d[0] * d[0];
    squares.xy += d[0] * d[1];
    squares.xz += d[0] * d[2];
    squares.yy += d[1] * d[1];
    squares.yz += d[1] * d[2];
    squares.zz += d[2] * d[2];
  }
  const double share = 1 / static_cast<double>(neighbors.size());
  const auto about_mean = [&](double square, double a, double b) {
    return (square - a * b * share) * share;
  };
  return {about_mean(squares.xx, sum[0], sum[0]), about_mean(squares.xy, sum[0], sum[1]),
          about_mean(squares.xz, sum[0], sum[2]), about_mean(squares.yy, sum[1], sum[1]),
          about_mean(squares.yz, sum[1], sum[2]), about_mean(squares.zz, sum[2], sum[2])};
}

/// The smallest root of the characteristic polynomial. Left of it the polynomial rises and is concave, so that Newton's
/// steps from 0 never go past it.
double least_eigenvalue(const Covariance& c) {
  constexpr int kMostSteps = 64;  // linear, by halves, only where two eigenvalues are equal
  const double trace = c.trace(), minors = c.minors(), determinant = c.determinant();
  double root = 0;
  for (int i = 0; i < kMostSteps; ++i) {
    const double value = ((root - trace) * root + minors) * root - determinant;
    const double slope = (3 * root - 2 * trace) * root + minors;
    if (!(value < 0) || !(slope > 0)) break;
    const double next = root - value / slope;
    if (!(next > root)) break;
    root = next;
  }
  return root;
}

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double squared_length(const Vector& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// The unit vector that the matrix less `eigenvalue` takes to 0: across its two rows that differ most.
Vector eigenvector(const Covariance& c, double eigenvalue) {
  const Vector rows[] = {{c.xx - eigenvalue, c.xy, c.xz},
                         {c.xy, c.yy - eigenvalue, c.yz},
                         {c.xz, c.yz, c.zz - eigenvalue}};
  Vector longest{};
  double most = 0;
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    const Vector across = cross(rows[i], rows[j]);
    const double length = squared_length(across);
    if (!(length > most)) continue;
    longest = across;
    most = length;
  }
  const double length = std::sqrt(most);
  return {longest[0] / length, longest[1] / length, longest[2] / length};
}

bool is_zero(const NormalVector& n) { return n[0] == 0 && n[1] == 0 && n[2] == 0; }

NormalVector negated(const NormalVector& n) { return {0 - n[0], 0 - n[1], 0 - n[2]}; }

/// Whether the first component that is not zero, of z, x, y, is positive.
bool looks_up(const NormalVector& n) {
  if (n[2] != 0) return n[2] > 0;
  return n[0] != 0 ? n[0] > 0 : n[1] > 0;
}

}  // namespace

NormalVector plane_normal(const formats::Grid& grid, std::span<const Neighbor> neighbors) {
  CAIRN_CHECK(!neighbors.empty());
  if (neighbors.size() < 3) return {0, 0, 0};
  const Covariance c = covariance_of(grid, neighbors);
  const double least = least_eigenvalue(c);
  // The other two eigenvalues have this sum and this product.
  const double sum = c.trace() - least, product = c.minors() - least * sum;
  if (!(product > kLine * sum * sum)) return {0, 0, 0};
  const Vector normal = eigenvector(c, least);
  // No component is a negative zero.
  return {static_cast<float>(normal[0]) + 0.0F, static_cast<float>(normal[1]) + 0.0F,
          static_cast<float>(normal[2]) + 0.0F};
}

NormalVector turned(const NormalVector& normal, const formats::WorldPoint& position,
                    const std::optional<formats::WorldPoint>& sensor) {
  if (is_zero(normal)) return normal;
  double towards = 0;
  if (sensor)
    for (std::size_t axis = 0; axis < 3; ++axis)
      towards += static_cast<double>(normal[axis]) * ((*sensor)[axis] - position[axis]);
  const bool right = towards != 0 ? towards > 0 : looks_up(normal);
  return right ? normal : negated(normal);
}

float splat_radius(const formats::Grid& grid, std::span<const Neighbor> neighbors) {
  CAIRN_CHECK(!neighbors.empty());
  const double shares = static_cast<double>(neighbors.size()) - 1;
  const double radius = shares == 0 ? *std::max_element(grid.step.begin(), grid.step.end())
                                    : std::sqrt(neighbors.back().squared_distance) *
                                          std::sqrt(std::numbers::pi / (2 * shares));
  return static_cast<float>(std::min(radius, double{std::numeric_limits<float>::max()}));
}

}  // namespace cairn::stages
