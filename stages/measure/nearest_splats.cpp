#include "stages/measure/nearest_splats.h"

#include <cmath>

namespace cairn::stages {

double distance_to(const Splat& splat, const std::array<double, 3>& step,
                   const formats::GridPoint& point) {
  double square = 0, along = 0, length = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double d =
        step[axis] * static_cast<double>(std::int64_t{point[axis]} - splat.position[axis]);
    const auto n = static_cast<double>(splat.normal[axis]);
    square += d * d;
    along += d * n;
    length += n * n;
  }
  if (!(length > 0)) return std::max(0.0, std::sqrt(square) - static_cast<double>(splat.radius));
  const double height = along / std::sqrt(length);
  const double aside = std::sqrt(std::max(0.0, square - height * height));
  return std::hypot(height, std::max(0.0, aside - static_cast<double>(splat.radius)));
}

void NearestSplats::offer(double squared_distance, std::size_t index) {
  if (count_ == kNearest && squared_distance >= found_.back().squared_distance) return;
  std::size_t at = count_ == kNearest ? count_ - 1 : count_++;
  for (; at > 0 && squared_distance < found_[at - 1].squared_distance; --at)
    found_[at] = found_[at - 1];
  found_[at] = {squared_distance, splats_->sites[index].widest};
}

}  // namespace cairn::stages
