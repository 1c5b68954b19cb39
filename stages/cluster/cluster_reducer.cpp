#include "stages/cluster/cluster_reducer.h"

#include <algorithm>
#include <cmath>

#include "formats/dataset/hilbert.h"
#include "formats/error.h"
#include "stages/cluster/cell_lists.h"
#include "stages/cluster/lloyd.h"
#include "stages/cluster/normals.h"
#include "stages/cluster/numbering.h"

namespace cairn::stages {

using formats::GridPoint;
using formats::Normal;

namespace {

/// A cluster on its way: known by the place on the curve of its first point.
struct Cluster {
  std::array<double, 3> center;  ///< lattice cells above the first point of the node
  double weight;
  double area;  ///< that it covers, beside what a point of the node covers on average
  Normal normal;

  /// Where normals cancel, the own one stays.
  void absorb(const Cluster& other);
};

void Cluster::absorb(const Cluster& other) {
  const double total = weight + other.weight;
  std::array<double, 3> facing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    center[axis] = (weight * center[axis] + other.weight * other.center[axis]) / total;
    facing[axis] = weight * double{normal[axis]} + other.weight * double{other.normal[axis]};
  }
  weight = total;
  area += other.area;
  const double length = std::hypot(facing[0], facing[1], facing[2]);
  if (length <= kCancelled * total) return;
  for (std::size_t axis = 0; axis < 3; ++axis)
    normal[axis] = static_cast<float>(facing[axis] / length);
}

/// By how much the area that a point covers may differ from the average of its node.
constexpr double kMostAreaRatio = 1e6;

/// Squared radii beside their mean: the areas that points cover. All are 1 where no point has a radius.
std::vector<double> relative_areas(std::span<const float> radius) {
  double sum = 0;
  for (const float r : radius) sum += double{r} * r;
  const double mean = sum / static_cast<double>(radius.size());
  std::vector<double> areas;
  areas.reserve(radius.size());
  for (const float r : radius)
    areas.push_back(mean > 0 ? std::clamp(double{r} * r / mean, 1 / kMostAreaRatio, kMostAreaRatio)
                             : 1);
  return areas;
}

/// The `count` merges of least cost, or all. Of equal ones the earlier are taken: no merge comes before one that it builds
/// on, nor costs less.
std::vector<Merge> cheapest(std::vector<Merge> merges, std::uint64_t count) {
  if (merges.size() <= count) return merges;
  std::vector<float> costs;
  costs.reserve(merges.size());
  for (const Merge& merge : merges) costs.push_back(merge.cost);
  const auto limit = costs.begin() + static_cast<std::ptrdiff_t>(count) - 1;
  std::nth_element(costs.begin(), limit, costs.end());
  const float highest = *limit;
  std::uint64_t equal = count - static_cast<std::uint64_t>(std::ranges::count_if(
                                    merges, [&](const Merge& m) { return m.cost < highest; }));
  std::erase_if(merges, [&](const Merge& merge) {
    if (merge.cost != highest) return merge.cost > highest;
    return equal == 0 || equal-- == 0;
  });
  return merges;
}

/// The clusters of a node in curve order, and who merged with whom.
class Clustering {
 public:
  explicit Clustering(const NodeView& node) : node_(node), parent_(node.position.size()) {
    const auto& order = node.curve.order;
    const GridPoint origin = node.position[order[0]];
    const std::vector<double> areas = relative_areas(node.radius);
    clusters_.resize(order.size());
    alive_.resize(order.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      const std::uint32_t point = order[i];
      Cluster& cluster = clusters_[i];
      for (std::size_t axis = 0; axis < 3; ++axis)
        cluster.center[axis] =
            static_cast<double>(std::int64_t{node.position[point][axis]} - origin[axis]) *
            node.grid.step[axis] * node.curve.cells_per_unit;
      cluster.weight = node.weight.empty() ? 1.0 : static_cast<double>(node.weight[point]);
      cluster.area = areas[point];
      cluster.normal = node.normal.empty() ? Normal{0, 0, 0} : node.normal[point];
      parent_[i] = i;
      alive_[i] = i;
    }
  }

  std::size_t count() const { return alive_.size(); }

  /// Of the clusters: on the curve, ascending.
  std::vector<std::uint64_t> keys() const;

  /// Merges points at one position that follow each other on the curve and face the way of the first of them, as far as
  /// `quota` allows: if not all may go, every group gives its share.
  void collapse_coincident(std::uint64_t quota, float theta_degrees);

  /// One round over all lists, of at most `longest` points, of the grid with `cell_bits`: the cheapest merges of all,
  /// until `quota` clusters are left, or one in each list. No list is cut to less than half of what would be the longest
  /// if the longest was always shortened: few points far from each other are all that a picture has there.
  void merge_lists(int cell_bits, std::uint32_t longest, std::uint64_t quota, ThetaRule theta);

  float theta_reached() const { return theta_reached_; }

  /// For each point its cluster, known by the place of its first one on the curve.
  std::vector<std::uint32_t> cluster_of_points() const;

 private:
  void load(std::span<const std::uint32_t> members, MergeList& list) const;
  void apply(const Merge& merge);
  void drop_merged();

  const NodeView& node_;
  std::vector<Cluster> clusters_;      ///< by place on the curve; valid for those alive
  std::vector<std::uint32_t> parent_;  ///< the cluster that a place has merged into, or itself
  std::vector<std::uint32_t> alive_;   ///< ascending
  float theta_reached_ = 0;
};

void Clustering::collapse_coincident(std::uint64_t quota, float theta_degrees) {
  const float min_cosine = cosine_of_limit(theta_degrees);
  const auto joins = [&](std::uint32_t first, std::uint32_t i) {
    return node_.position[node_.curve.order[first]] == node_.position[node_.curve.order[i]] &&
           agreement(clusters_[first].normal, clusters_[i].normal) >= min_cosine;
  };
  std::vector<std::uint32_t> group_of(clusters_.size());  // first place of the group
  std::uint64_t possible = 0;
  for (std::uint32_t i = 1; i < clusters_.size(); ++i) {
    const std::uint32_t first = group_of[i - 1];
    group_of[i] = joins(first, i) ? first : i;
    possible += group_of[i] != i;
  }
  if (possible == 0) return;
  const std::uint64_t allowed = std::min<std::uint64_t>(possible, clusters_.size() - quota);
  std::uint64_t before = 0;  // possible merges in the groups so far
  for (std::uint32_t first = 0; first < clusters_.size();) {
    std::uint32_t last = first + 1;
    while (last < clusters_.size() && group_of[last] == first) ++last;
    const std::uint64_t size = last - first, after = before + size - 1;
    // A group's share of the allowed merges leaves it `kept` clusters of equal parts.
    const std::uint64_t kept = size - (after * allowed / possible - before * allowed / possible);
    std::uint32_t winner = first;
    for (std::uint64_t k = 1; k < size; ++k) {
      const auto i = static_cast<std::uint32_t>(first + k);
      if (k * kept / size != (k - 1) * kept / size) {
        winner = i;
        continue;
      }
      parent_[i] = winner;
      clusters_[winner].weight += clusters_[i].weight;
      clusters_[winner].area += clusters_[i].area;
    }
    before = after;
    first = last;
  }
  drop_merged();
}

void Clustering::load(std::span<const std::uint32_t> members, MergeList& list) const {
  list.count = static_cast<std::uint32_t>(members.size());
  // Relative to the list's first cluster, single precision tells neighbours apart wherever they lie.
  const std::array<double, 3> origin = clusters_[members[0]].center;
  for (std::uint32_t k = 0; k < list.count; ++k) {
    const Cluster& cluster = clusters_[members[k]];
    list.x[k] = static_cast<float>(cluster.center[0] - origin[0]);
    list.y[k] = static_cast<float>(cluster.center[1] - origin[1]);
    list.z[k] = static_cast<float>(cluster.center[2] - origin[2]);
    list.weight[k] = static_cast<float>(cluster.weight);
    list.area[k] = static_cast<float>(cluster.area);
    list.cost[k] = 0;
    list.nx[k] = cluster.normal[0];
    list.ny[k] = cluster.normal[1];
    list.nz[k] = cluster.normal[2];
    list.id[k] = members[k];
  }
}

void Clustering::apply(const Merge& merge) {
  clusters_[merge.winner].absorb(clusters_[merge.loser]);
  parent_[merge.loser] = merge.winner;
  theta_reached_ = std::max(theta_reached_, merge.theta_degrees);
}

void Clustering::drop_merged() {
  std::erase_if(alive_, [&](std::uint32_t i) { return parent_[i] != i; });
}

std::vector<std::uint64_t> Clustering::keys() const {
  std::vector<std::uint64_t> keys;
  keys.reserve(alive_.size());
  for (const std::uint32_t i : alive_) keys.push_back(node_.curve.key[i]);
  return keys;
}

void Clustering::merge_lists(int cell_bits, std::uint32_t longest, std::uint64_t quota,
                             ThetaRule theta) {
  const std::vector<std::uint32_t> starts = cut_lists(keys(), cell_bits, longest);
  std::vector<std::uint32_t> lengths;
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) lengths.push_back(starts[i + 1] - starts[i]);
  const std::uint32_t least = (leveled_length(lengths, quota) + 1) / 2;
  std::vector<Merge> merges;
  MergeList list;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (lengths[i] <= least) continue;
    load(std::span(alive_).subspan(starts[i], lengths[i]), list);
    const MergeOutcome outcome = merge_pairs(list, least, theta);
    merges.insert(merges.end(), outcome.merges.begin(), outcome.merges.begin() + outcome.count);
  }
  for (const Merge& merge : cheapest(std::move(merges), alive_.size() - quota)) apply(merge);
  drop_merged();
}

std::vector<std::uint32_t> Clustering::cluster_of_points() const {
  // A loser always comes later on the curve than its winner, so one pass in curve order resolves all.
  std::vector<std::uint32_t> of_place(parent_), of_point(parent_.size());
  for (std::uint32_t i = 0; i < of_place.size(); ++i) {
    CAIRN_CHECK(parent_[i] <= i);
    of_place[i] = of_place[parent_[i]];
    of_point[node_.curve.order[i]] = of_place[i];
  }
  return of_point;
}

/// Cells along the longest axis, of K given ones if any, once so many times each two of them were joined: of an odd number
/// the last one stays alone.
std::uint32_t cells_along(std::optional<std::uint32_t> grid, int cell_bits, int joined) {
  return grid ? (*grid + (1U << joined) - 1) >> joined : 1U << cell_bits;
}

struct GridUse {
  std::uint32_t cells = 0;  ///< along the longest axis of the coarsest grid; 0: no merging was left
  bool coarsened = false;
};

/// Merges within cells until `quota` clusters are left. `given_cell_bits`: of the grid that options give, if they do.
GridUse merge_in_grid(Clustering& clustering, int given_cell_bits, std::uint64_t quota,
                      const ClusterOptions& options) {
  if (clustering.count() <= quota) return {};
  const int first_cell_bits = options.grid ? given_cell_bits : auto_cell_bits(clustering.keys());
  const std::uint32_t longest_list = options.grid ? kMaxListLength : kAutoListLength;
  int cell_bits = first_cell_bits;
  while (true) {
    clustering.merge_lists(cell_bits, longest_list, quota, options.theta);
    if (clustering.count() <= quota) break;
    cell_bits = std::max(0, cell_bits - 1);
  }
  return {.cells = cells_along(options.grid, cell_bits, first_cell_bits - cell_bits),
          .coarsened = cell_bits < first_cell_bits};
}

}  // namespace

Reduction ClusterReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  CAIRN_CHECK(quota >= 1 && quota <= node.position.size());
  Clustering clustering(node);
  clustering.collapse_coincident(quota, options_.theta.start_degrees);
  const GridUse used = merge_in_grid(clustering, node.curve.cell_bits, quota, options_);
  std::vector<std::uint32_t> representative = clustering.cluster_of_points();
  number_along(node.curve.order, quota, representative);
  for (std::uint32_t pass = 0; pass < options_.refinement; ++pass)
    lloyd_pass(node, options_.theta.start_degrees, quota, representative);
  number_along(node.curve.order, quota, representative);
  return {.representative = std::move(representative),
          .chosen = {},
          .blend = {},
          .theta_degrees = node.normal.empty()
                               ? 0
                               : std::max(options_.theta.start_degrees, clustering.theta_reached()),
          .grid = used.cells,
          .theta_relaxed = clustering.theta_reached() > options_.theta.start_degrees,
          .grid_coarsened = used.coarsened};
}

}  // namespace cairn::stages
