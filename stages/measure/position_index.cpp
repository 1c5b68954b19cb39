// The one place that knows FLANN.
#include "stages/measure/position_index.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>

#include "formats/error.h"

namespace cairn::stages {

using formats::GridPoint;

namespace {

/// formats::squared_distance on coordinates that are grid steps: doubles hold these and their
/// differences exactly, so a distance does not depend on where the points lie.
struct StepDistance {
  using is_kdtree_distance = bool;
  using ElementType = double;
  using ResultType = double;

  std::array<double, 3> step{1, 1, 1};

  template <typename A, typename B>
  double operator()(A a, B b, std::size_t, double = -1) const {
    const double x = step[0] * (a[0] - b[0]), y = step[1] * (a[1] - b[1]),
                 z = step[2] * (a[2] - b[2]);
    return x * x + y * y + z * z;
  }
  template <typename A, typename B>
  double accum_dist(const A& a, const B& b, std::size_t axis) const {
    const double d = step[axis] * (a - b);
    return d * d;
  }
};

/// FLANN adds the distances to its planes up and takes them away again; the slack lets no rounding of
/// these sums hide a branch.
constexpr float kPruningSlack = -1e-5F;

/// The smallest number above one that is finite and not negative.
double next_above(double value) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value + 0.0) + 1);
}

/// Lets FLANN fill a sink. FLANN offers what is nearer than worstDist(), so that is the next number
/// above the reach: of positions as far as that the sink decides by itself.
class Collector final : public flann::ResultSet<double> {
 public:
  explicit Collector(PositionSink& sink) : sink_(sink) {}
  bool full() const override { return std::isfinite(sink_.reach()); }
  double worstDist() const override {
    const double reach = sink_.reach();
    return std::isfinite(reach) ? next_above(reach) : reach;
  }
  void addPoint(double squared_distance, std::size_t index) override {
    if (squared_distance <= sink_.reach()) sink_.offer(squared_distance, index);
  }

 private:
  PositionSink& sink_;
};

}  // namespace

struct PositionIndex::Tree {
  using Flann = flann::KDTreeSingleIndex<StepDistance>;

  Tree(std::span<const GridPoint> positions, const std::array<double, 3>& step)
      : coordinates(3 * positions.size()) {
    for (std::size_t i = 0; i < positions.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) coordinates[3 * i + axis] = positions[i][axis];
    const flann::Matrix<double> matrix(coordinates.data(), positions.size(), 3);
    index.emplace(matrix, flann::KDTreeSingleIndexParams(), StepDistance{step});
    index->buildIndex();
  }

  std::vector<double> coordinates;
  std::optional<Flann> index;
  flann::SearchParams exact{flann::FLANN_CHECKS_UNLIMITED, kPruningSlack};
};

PositionIndex::PositionIndex(std::span<const GridPoint> positions,
                             const std::array<double, 3>& step) {
  CAIRN_CHECK(!positions.empty());
  tree_ = std::make_unique<Tree>(positions, step);
}

PositionIndex::~PositionIndex() = default;

void PositionIndex::search(const GridPoint& query, PositionSink& sink) const {
  const std::array<double, 3> at{static_cast<double>(query[0]), static_cast<double>(query[1]),
                                 static_cast<double>(query[2])};
  Collector collector(sink);
  tree_->index->findNeighbors(collector, at.data(), tree_->exact);
}

}  // namespace cairn::stages
