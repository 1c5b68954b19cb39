// How splats, as spheres, cover a point: how many do, and by what factor radii would have to grow for one to do.
#pragma once

#include <cstdint>

#include "stages/measure/level_search.h"

namespace cairn::stages {

/// Squared ratio of a distance to a radius: the square of the factor by which the radius just reaches. Infinite of a
/// radius 0 that does not.
double squared_need(double squared_distance, double radius);

/// Counts all splats whose spheres hold the query, and finds the least need of all splats of the level. The search is
/// exact: what lies no nearer than d, with radii up to w, needs d / w, so nodes are left out where that is above 1
/// and no less than the least need so far.
class CoverSearch final : public SplatSink {
 public:
  /// `squared_need`: of any splat of the level, so that the search is short.
  explicit CoverSearch(double squared_need) : squared_need_(squared_need) {}

  double rank(double box_squared_distance, double widest) const override {
    return stages::squared_need(box_squared_distance, widest);
  }
  bool wants(double rank) const override { return rank <= 1 || rank < squared_need_; }
  void begin(const SplatNode::RadiusClass& splats) override { splats_ = &splats; }
  double reach() const override;
  void offer(double squared_distance, std::size_t index) override;

  std::uint64_t covering() const { return covering_; }
  double squared_need() const { return squared_need_; }

 private:
  const SplatNode::RadiusClass* splats_ = nullptr;
  double squared_need_;
  std::uint64_t covering_ = 0;
};

}  // namespace cairn::stages
