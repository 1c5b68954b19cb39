// Where a scan stands in the world.
#pragma once

#include <array>
#include <optional>

namespace cairn::formats {

using Vector3 = std::array<double, 3>;

/// An affine map from a scan's own frame to the world: world = linear * p + translation. Nearly always rigid;
/// some formats allow scales too.
struct Pose {
  std::array<Vector3, 3> linear{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< rows
  Vector3 translation{};

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// `pose.linear * p + pose.translation`, in double.
Vector3 place(const Pose& pose, const Vector3& p);

/// The matrix by which normals turn: `linear` itself where that is a rotation (to 1e-6), else its inverse
/// transposed.
std::array<Vector3, 3> normal_matrix(const Pose& pose);

Vector3 multiply(const std::array<Vector3, 3>& matrix, const Vector3& v);

/// The rotation matrix of a quaternion w + xi + yj + zk of any length. Nothing where it is zero or not finite.
std::optional<std::array<Vector3, 3>> rotation_of(double w, double x, double y, double z);

std::array<Vector3, 3> transposed(const std::array<Vector3, 3>& matrix);

/// Whether all numbers are finite and the linear part can be inverted.
bool is_usable(const Pose& pose);

}  // namespace cairn::formats
