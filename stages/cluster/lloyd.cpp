#include "stages/cluster/lloyd.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/cluster/center_tree.h"
#include "stages/cluster/normals.h"

namespace cairn::stages {

using formats::Normal;

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

struct Centers {
  std::vector<Location> place;
  std::vector<Normal> normal;  ///< unit or zero; empty: the dataset has none
};

/// Weighted means of the clusters' points, summed up in the points' order.
Centers centers_of(const NodeView& node, const Places& places, std::uint64_t quota,
                   const std::vector<std::uint32_t>& representative) {
  std::vector<Location> sum(quota), facing(node.normal.empty() ? 0 : quota);
  std::vector<double> weight(quota);
  for (std::size_t i = 0; i < representative.size(); ++i) {
    const std::uint32_t r = representative[i];
    const double w = node.weight.empty() ? 1 : static_cast<double>(node.weight[i]);
    const Location place = places[i];
    weight[r] += w;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum[r][axis] += w * place[axis];
      if (!facing.empty()) facing[r][axis] += w * double{node.normal[i][axis]};
    }
  }
  Centers centers{std::move(sum), std::vector<Normal>(facing.size())};
  for (std::size_t r = 0; r < quota; ++r)
    for (double& coordinate : centers.place[r]) coordinate /= weight[r];
  for (std::size_t r = 0; r < facing.size(); ++r) {
    const double length = std::sqrt(squared_distance(facing[r], {0, 0, 0}));
    if (length <= kCancelled * weight[r]) continue;
    for (std::size_t axis = 0; axis < 3; ++axis)
      centers.normal[r][axis] = static_cast<float>(facing[r][axis] / length);
  }
  return centers;
}

/// For each cluster the point nearest to its center, the first of several.
std::vector<std::uint32_t> points_that_stay(const Centers& centers,
                                            const std::vector<double>& squares,
                                            const std::vector<std::uint32_t>& representative) {
  std::vector<std::uint32_t> nearest(centers.place.size(), kNone);
  for (std::uint32_t i = 0; i < representative.size(); ++i) {
    std::uint32_t& best = nearest[representative[i]];
    if (best == kNone || squares[i] < squares[best]) best = i;
  }
  return nearest;
}

/// For each center the square of half its distance to the nearest other: a point within it is nearest to that center.
/// (C. Elkan, "Using the triangle inequality to accelerate k-means", 2003, lemma 1.)
std::vector<double> squared_half_gaps(const std::vector<Location>& centers,
                                      const CenterTree& tree) {
  std::vector<double> squares(centers.size());
  for (std::uint32_t r = 0; r < centers.size(); ++r) {
    double nearest = std::numeric_limits<double>::infinity();
    tree.search(centers[r], nearest, [&](std::uint32_t other, double square) {
      return other == r ? nearest : nearest = std::min(nearest, square);
    });
    squares[r] = nearest / 4;
  }
  return squares;
}

class Pass {
 public:
  Pass(const NodeView& node, float theta_degrees, std::uint64_t quota,
       std::vector<std::uint32_t>& representative)
      : node_(node),
        places_(node),
        representative_(representative),
        centers_(centers_of(node, places_, quota, representative)),
        tree_(centers_.place),
        min_cosine_(cosine_of_limit(theta_degrees)) {}

  void run() {
    std::vector<double> squares(representative_.size());
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] = squared_distance(places_[i], centers_.place[representative_[i]]);
    const std::vector<std::uint32_t> stays = points_that_stay(centers_, squares, representative_);
    const std::vector<double> at_home = squared_half_gaps(centers_.place, tree_);
    for (const std::uint32_t i : node_.curve.order) {
      const std::uint32_t own = representative_[i];
      if (squares[i] > at_home[own] && stays[own] != i)
        representative_[i] = nearest_center(i, squares[i]);
    }
  }

 private:
  /// Of those that face the point's way; its own one if none is nearer.
  std::uint32_t nearest_center(std::uint32_t point, double own_square) const {
    const std::uint32_t own = representative_[point];
    const Normal normal = node_.normal.empty() ? Normal{0, 0, 0} : node_.normal[point];
    const float least = std::min(min_cosine_, agreement_with(own, normal));
    std::uint32_t best = own;
    double best_square = own_square;
    tree_.search(places_[point], best_square, [&](std::uint32_t r, double square) {
      if (agreement_with(r, normal) >= least) {
        best = r;
        best_square = square;
      }
      return best_square;
    });
    return best;
  }

  float agreement_with(std::uint32_t center, const Normal& normal) const {
    return centers_.normal.empty() ? 1 : agreement(normal, centers_.normal[center]);
  }

  const NodeView& node_;
  const Places places_;
  std::vector<std::uint32_t>& representative_;
  const Centers centers_;
  const CenterTree tree_;
  const float min_cosine_;
};

}  // namespace

void lloyd_pass(const NodeView& node, float theta_degrees, std::uint64_t quota,
                std::vector<std::uint32_t>& representative) {
  Pass(node, theta_degrees, quota, representative).run();
}

}  // namespace cairn::stages
