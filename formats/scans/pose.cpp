#include "formats/scans/pose.h"

#include <algorithm>
#include <cmath>

namespace cairn::formats {
namespace {

using Matrix = std::array<Vector3, 3>;

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double determinant(const Matrix& m) { return dot(m[0], cross(m[1], m[2])); }

bool is_rotation(const Matrix& m) {
  constexpr double kTolerance = 1e-6;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      if (!(std::fabs(dot(m[i], m[j]) - (i == j ? 1 : 0)) <= kTolerance)) return false;
  return determinant(m) > 0;
}

}  // namespace

Vector3 multiply(const Matrix& matrix, const Vector3& v) {
  return {dot(matrix[0], v), dot(matrix[1], v), dot(matrix[2], v)};
}

Vector3 place(const Pose& pose, const Vector3& p) {
  const Vector3 turned = multiply(pose.linear, p);
  return {turned[0] + pose.translation[0], turned[1] + pose.translation[1],
          turned[2] + pose.translation[2]};
}

Matrix normal_matrix(const Pose& pose) {
  const Matrix& m = pose.linear;
  if (is_rotation(m)) return m;
  // The cofactors are the inverse transposed times the determinant.
  Matrix cofactors{cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};
  const double det = determinant(m);
  for (Vector3& row : cofactors)
    for (double& value : row) value /= det;
  return cofactors;
}

std::optional<Matrix> rotation_of(double w, double x, double y, double z) {
  const double squared = w * w + x * x + y * y + z * z;
  if (!std::isfinite(squared) || squared <= 0) return std::nullopt;
  const double s = 2 / squared;
  return Matrix{{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                 {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                 {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}}};
}

Matrix transposed(const Matrix& m) {
  return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

bool is_usable(const Pose& pose) {
  const auto finite = [](const Vector3& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  };
  if (!finite(pose.translation) || !std::all_of(pose.linear.begin(), pose.linear.end(), finite))
    return false;
  const double det = determinant(pose.linear);
  return std::isfinite(det) && std::isfinite(1 / det);
}

}  // namespace cairn::formats
