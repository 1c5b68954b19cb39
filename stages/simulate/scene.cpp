#include "stages/simulate/scene.h"

#include "formats/error.h"
#include "stages/simulate/angles.h"

namespace cairn::stages {
namespace {

Quaternion about(std::size_t axis, double degrees) {
  const SineCosine half = sine_cosine(degrees / 2);
  Quaternion q{half.cosine, 0, 0, 0};
  q[axis + 1] = half.sine;
  return q;
}

}  // namespace

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

Quaternion turned(double yaw, double pitch, double roll) {
  return product(product(about(2, yaw), about(1, -pitch)), about(0, roll));
}

formats::Pose pose_at(const Vector3& position, const Quaternion& turn) {
  const auto rotation = formats::rotation_of(turn[0], turn[1], turn[2], turn[3]);
  CAIRN_CHECK(rotation.has_value());
  return {.linear = *rotation, .translation = position};
}

}  // namespace cairn::stages
