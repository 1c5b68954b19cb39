#include "stages/cluster/lloyd.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/cluster/center_tree.h"
#include "stages/cluster/normals.h"
#include "stages/vector_path.h"

namespace cairn::stages {

using formats::Normal;

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Covers the rounding of squared distances.
constexpr double kRoundUp = 1 + 1e-9;

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

/// The centers that points of a cluster may move to.
struct Surroundings {
  std::uint32_t first, last;  ///< into Pass::near_
  bool complete;              ///< else there are too many to list
  /// Of half the distance to the nearest of them: a point within it is nearest to its own center. (C. Elkan, "Using the
  /// triangle inequality to accelerate k-means", 2003, lemma 1.)
  double square_at_home;
};

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
    const std::vector<Surroundings> surroundings = look_around(squares);
    for (const std::uint32_t i : node_.curve.order) {
      const std::uint32_t own = representative_[i];
      if (squares[i] > surroundings[own].square_at_home && stays[own] != i)
        representative_[i] = nearest_center(i, squares[i], surroundings[own]);
    }
  }

 private:
  /// More centers about one are rare, but there may be very many.
  static constexpr std::size_t kMostListed = 32;

  /// Centers that are nearer to a point than its own are less than twice as far from that one as the point is.
  std::vector<Surroundings> look_around(const std::vector<double>& squares) {
    std::vector<double> farthest(centers_.place.size());
    for (std::size_t i = 0; i < squares.size(); ++i)
      farthest[representative_[i]] = std::max(farthest[representative_[i]], squares[i]);
    std::vector<Surroundings> surroundings;
    surroundings.reserve(farthest.size());
    for (std::uint32_t r = 0; r < farthest.size(); ++r)
      surroundings.push_back(look_around(r, kRoundUp * 4 * farthest[r]));
    return surroundings;
  }

  Surroundings look_around(std::uint32_t center, double limit) {
    Surroundings found{static_cast<std::uint32_t>(near_.size()), 0, true, limit};
    tree_.search(centers_.place[center], limit, [&](std::uint32_t other, double square) {
      if (other == center) return limit;
      if (near_.size() - found.first == kMostListed) {
        found.complete = false;
        return 0.0;
      }
      near_.push_back(other);
      found.square_at_home = std::min(found.square_at_home, square / 4);
      return limit;
    });
    found.last = static_cast<std::uint32_t>(near_.size());
    if (!found.complete) found.square_at_home = 0;
    return found;
  }

  /// Of those that face the point's way; its own one if none is nearer.
  std::uint32_t nearest_center(std::uint32_t point, double own_square,
                               const Surroundings& around) const {
    const std::uint32_t own = representative_[point];
    const Location place = places_[point];
    const Normal normal = node_.normal.empty() ? Normal{0, 0, 0} : node_.normal[point];
    const float least = std::min(min_cosine_, agreement_with(own, normal));
    std::uint32_t best = own;
    double best_square = own_square;
    const auto consider = [&](std::uint32_t r, double square) {
      if (square < best_square && agreement_with(r, normal) >= least) {
        best = r;
        best_square = square;
      }
      return best_square;
    };
    if (around.complete)
      for (std::uint32_t k = around.first; k < around.last; ++k)
        consider(near_[k], squared_distance(place, centers_.place[near_[k]]));
    else
      tree_.search(place, best_square, consider);
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
  std::vector<std::uint32_t> near_;
};

void run(Pass& pass) { pass.run(); }

}  // namespace

void lloyd_pass(const NodeView& node, float theta_degrees, std::uint64_t quota,
                std::vector<std::uint32_t>& representative) {
  Pass pass(node, theta_degrees, quota, representative);
  vectorized<run>(pass);
}

}  // namespace cairn::stages
