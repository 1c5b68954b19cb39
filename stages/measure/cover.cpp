#include "stages/measure/cover.h"

#include <limits>

namespace cairn::stages {

double squared_need(double squared_distance, double radius) {
  if (squared_distance == 0) return 0;
  return radius > 0 ? squared_distance / (radius * radius)
                    : std::numeric_limits<double>::infinity();
}

double CoverSearch::reach() const {
  const double widest = splats_->widest;
  return widest > 0 ? std::max(1.0, squared_need_) * (widest * widest) : 0;
}

void CoverSearch::offer(double squared_distance, std::size_t index) {
  const SplatNode::Site& site = splats_->sites[index];
  squared_need_ =
      std::min(squared_need_,
               stages::squared_need(squared_distance, static_cast<double>(site.widest.radius)));
  for (std::uint32_t i = site.first_radius; i < site.end_radius; ++i) {
    const auto radius = static_cast<double>(splats_->radii[i]);
    if (squared_distance > radius * radius) break;
    ++covering_;
  }
}

}  // namespace cairn::stages
