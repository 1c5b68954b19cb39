#include "stages/cluster/cluster_reducer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "formats/error.h"
#include "stages/cluster/cell_lists.h"
#include "stages/cluster/curve_points.h"
#include "stages/cluster/lloyd.h"
#include "stages/cluster/normals.h"
#include "stages/cluster/numbering.h"

namespace cairn::stages {

using formats::Normal;

namespace {

/// Clusters on their way, along the curve by their first points.
struct Clusters {
  CurvePoints mean;
  std::vector<float> area;  ///< that each covers, beside what a point of the node covers on average
  std::vector<std::uint64_t> key;  ///< of their first points, ascending
};

/// As Clusters, of another's.
struct ClustersView {
  const CurvePoints* mean;
  std::span<const float> area;
  std::span<const std::uint64_t> key;
};

/// What clusters become when each joins the one that `winner_of` names: itself, or one before it that joins none.
Clusters joined(const ClustersView& clusters, const std::vector<std::uint32_t>& winner_of) {
  struct Sum {
    double weight = 0, area = 0;
    std::array<double, 3> place{}, facing{};
  };
  const CurvePoints& from = *clusters.mean;
  std::vector<Sum> sums(from.count());
  for (std::size_t i = 0; i < from.count(); ++i) {
    Sum& sum = sums[winner_of[i]];
    const double w = from.weight_of(i);
    const Normal normal = from.normal_of(i);
    const std::array<double, 3> place{from.x[i], from.y[i], from.z[i]};
    sum.weight += w;
    sum.area += double{clusters.area[i]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum.place[axis] += w * place[axis];
      sum.facing[axis] += w * double{normal[axis]};
    }
  }
  Clusters to;
  for (std::size_t i = 0; i < from.count(); ++i) {
    if (winner_of[i] != i) continue;
    const Sum& sum = sums[i];
    to.mean.weight.push_back(sum.weight);
    to.mean.x.push_back(sum.place[0] / sum.weight);
    to.mean.y.push_back(sum.place[1] / sum.weight);
    to.mean.z.push_back(sum.place[2] / sum.weight);
    to.area.push_back(static_cast<float>(sum.area));
    to.key.push_back(clusters.key[i]);
    if (!from.has_normals()) continue;
    // Where normals cancel, that of the first stays.
    const double length = std::hypot(sum.facing[0], sum.facing[1], sum.facing[2]);
    Normal normal = from.normal_of(i);
    for (std::size_t axis = 0; axis < 3 && length > kCancelled * sum.weight; ++axis)
      normal[axis] = static_cast<float>(sum.facing[axis] / length);
    to.mean.nx.push_back(normal[0]);
    to.mean.ny.push_back(normal[1]);
    to.mean.nz.push_back(normal[2]);
  }
  return to;
}

/// By how much the area that a point covers may differ from the average of its node.
constexpr double kMostAreaRatio = 1e6;

/// Squared radii beside their mean, along the curve: the areas that points cover. All are 1 where no point has a radius.
std::vector<float> relative_areas(const NodeView& node) {
  double sum = 0;
  for (const float r : node.radius) sum += double{r} * r;
  const double mean = sum / static_cast<double>(node.radius.size());
  std::vector<float> areas(node.radius.size(), 1);
  if (!(mean > 0)) return areas;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const double radius = double{node.radius[node.curve.order[i]]};
    areas[i] =
        static_cast<float>(std::clamp(radius * radius / mean, 1 / kMostAreaRatio, kMostAreaRatio));
  }
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

/// The clusters of a node, and which of its points are in each.
class Clustering {
 public:
  Clustering(const NodeView& node, const CurvePoints& points, std::uint64_t quota)
      : node_(node),
        quota_(quota),
        areas_(relative_areas(node)),
        now_{&points, areas_, node.curve.key},
        count_(points.count()),
        cluster_of_(points.count()) {
    std::iota(cluster_of_.begin(), cluster_of_.end(), 0U);
  }

  bool done() const { return count_ == quota_; }
  /// Of the clusters, unless they are done.
  std::span<const std::uint64_t> keys() const { return now_.key; }

  /// Merges points at one position that follow each other on the curve and face the way of the first of them, as far as
  /// `quota` allows: if not all may go, every group gives its share. To be called first.
  void collapse_coincident(float theta_degrees);

  /// One round over all lists, of at most `longest` points, of the grid with `cell_bits`: the cheapest merges of all,
  /// until `quota` clusters are left, or one in each list. No list is cut to less than half of what would be the longest
  /// if the longest was always shortened: few points far from each other are all that a picture has there.
  void merge_lists(int cell_bits, std::uint32_t longest, ThetaRule theta);

  float theta_reached() const { return theta_reached_; }

  /// For each point along the curve its cluster. They are numbered along the curve by their first points.
  std::vector<std::uint32_t> cluster_of_points() && { return std::move(cluster_of_); }

 private:
  void load(std::uint32_t first, std::uint32_t count, MergeList& list) const;
  void join(std::vector<std::uint32_t> winner_of);

  const NodeView& node_;
  const std::uint64_t quota_;
  const std::vector<float> areas_;
  Clusters joined_;  ///< what `now_` shows, once any were joined
  ClustersView now_;
  std::size_t count_;
  std::vector<std::uint32_t> cluster_of_;
  float theta_reached_ = 0;
};

void Clustering::collapse_coincident(float theta_degrees) {
  const float min_cosine = cosine_of_limit(theta_degrees);
  const auto joins = [&](std::uint32_t first, std::uint32_t i) {
    return now_.key[first] == now_.key[i] &&
           node_.position[node_.curve.order[first]] == node_.position[node_.curve.order[i]] &&
           agreement(now_.mean->normal_of(first), now_.mean->normal_of(i)) >= min_cosine;
  };
  const auto points = static_cast<std::uint32_t>(count_);
  std::vector<std::uint32_t> group_of(points);  // first place of the group
  std::uint64_t possible = 0;
  for (std::uint32_t i = 1; i < points; ++i) {
    const std::uint32_t first = group_of[i - 1];
    group_of[i] = joins(first, i) ? first : i;
    possible += group_of[i] != i;
  }
  if (possible == 0) return;
  const std::uint64_t allowed = std::min<std::uint64_t>(possible, points - quota_);
  std::vector<std::uint32_t> winner_of(points);
  std::uint64_t before = 0;  // possible merges in the groups so far
  for (std::uint32_t first = 0; first < points;) {
    std::uint32_t last = first + 1;
    while (last < points && group_of[last] == first) ++last;
    const std::uint64_t size = last - first, after = before + size - 1;
    // A group's share of the allowed merges leaves it `kept` clusters of equal parts.
    const std::uint64_t kept = size - (after * allowed / possible - before * allowed / possible);
    std::uint32_t winner = first;
    winner_of[first] = first;
    for (std::uint64_t k = 1; k < size; ++k) {
      const auto i = static_cast<std::uint32_t>(first + k);
      if (k * kept / size != (k - 1) * kept / size) winner = i;
      winner_of[i] = winner;
    }
    before = after;
    first = last;
  }
  join(std::move(winner_of));
}

void Clustering::load(std::uint32_t first, std::uint32_t count, MergeList& list) const {
  list.count = count;
  list.has_normals = now_.mean->has_normals();
  // Relative to the list's first cluster, single precision tells neighbours apart wherever they lie.
  const auto fill = [&](const std::vector<double>& from, auto& column) {
    for (std::uint32_t k = 0; k < count; ++k)
      column[k] = static_cast<float>(from[first + k] - from[first]);
  };
  fill(now_.mean->x, list.x);
  fill(now_.mean->y, list.y);
  fill(now_.mean->z, list.z);
  const auto copy = [&](const auto& from, auto& column) {
    for (std::uint32_t k = 0; k < count; ++k) column[k] = static_cast<float>(from[first + k]);
  };
  if (now_.mean->weight.empty())
    std::fill_n(list.weight.begin(), count, 1.0F);
  else
    copy(now_.mean->weight, list.weight);
  copy(now_.area, list.area);
  if (list.has_normals) {
    copy(now_.mean->nx, list.nx);
    copy(now_.mean->ny, list.ny);
    copy(now_.mean->nz, list.nz);
  }
  std::fill_n(list.cost.begin(), count, 0.0F);
  for (std::uint32_t k = 0; k < count; ++k) list.id[k] = first + k;
}

/// A loser always comes later on the curve than its winner.
void Clustering::join(std::vector<std::uint32_t> winner_of) {
  std::vector<std::uint32_t> number_of(winner_of.size());
  count_ = 0;
  for (std::uint32_t i = 0; i < winner_of.size(); ++i) {
    CAIRN_CHECK(winner_of[i] <= i);
    const std::uint32_t winner = winner_of[i] = winner_of[winner_of[i]];
    // No processor foresees which clusters win: no branch depends on it.
    number_of[i] = static_cast<std::uint32_t>(count_);
    number_of[i] = number_of[winner];
    count_ += winner == i ? 1 : 0;
  }
  for (std::uint32_t& cluster : cluster_of_) cluster = number_of[cluster];
  if (count_ == quota_) return;  // nothing is left to merge
  joined_ = joined(now_, winner_of);
  now_ = {&joined_.mean, joined_.area, joined_.key};
}

void Clustering::merge_lists(int cell_bits, std::uint32_t longest, ThetaRule theta) {
  const std::vector<std::uint32_t> starts = cut_lists(keys(), cell_bits, longest);
  std::vector<std::uint32_t> lengths;
  for (std::size_t i = 0; i + 1 < starts.size(); ++i) lengths.push_back(starts[i + 1] - starts[i]);
  const std::uint32_t least = (leveled_length(lengths, quota_) + 1) / 2;
  std::vector<Merge> merges;
  MergeList list;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (lengths[i] <= least) continue;
    load(starts[i], lengths[i], list);
    const MergeOutcome outcome = merge_pairs(list, least, theta);
    merges.insert(merges.end(), outcome.merges.begin(), outcome.merges.begin() + outcome.count);
  }
  std::vector<std::uint32_t> winner_of(count_);
  std::iota(winner_of.begin(), winner_of.end(), 0U);
  for (const Merge& merge : cheapest(std::move(merges), count_ - quota_)) {
    winner_of[merge.loser] = merge.winner;
    theta_reached_ = std::max(theta_reached_, merge.theta_degrees);
  }
  join(std::move(winner_of));
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

/// Merges within cells until clustering is done. `given_cell_bits`: of the grid that options give, if they do.
GridUse merge_in_grid(Clustering& clustering, int given_cell_bits, const ClusterOptions& options) {
  if (clustering.done()) return {};
  const int first_cell_bits = options.grid ? given_cell_bits : auto_cell_bits(clustering.keys());
  const std::uint32_t longest_list = options.grid ? kMaxListLength : kAutoListLength;
  int cell_bits = first_cell_bits;
  while (true) {
    clustering.merge_lists(cell_bits, longest_list, options.theta);
    if (clustering.done()) break;
    cell_bits = std::max(0, cell_bits - 1);
  }
  return {.cells = cells_along(options.grid, cell_bits, first_cell_bits - cell_bits),
          .coarsened = cell_bits < first_cell_bits};
}

}  // namespace

Reduction ClusterReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  CAIRN_CHECK(quota >= 1 && quota <= node.position.size());
  const CurvePoints points = points_along_curve(node);
  Clustering clustering(node, points, quota);
  clustering.collapse_coincident(options_.theta.start_degrees);
  const GridUse used = merge_in_grid(clustering, node.curve.cell_bits, options_);
  const float theta_reached = clustering.theta_reached();
  std::vector<std::uint32_t> cluster_of = std::move(clustering).cluster_of_points();
  for (std::uint32_t pass = 0; pass < options_.refinement; ++pass)
    lloyd_pass(points, options_.theta.start_degrees, quota, cluster_of);
  number_along(quota, cluster_of);
  return {.representative = by_point(node.curve, cluster_of),
          .chosen = {},
          .blend = {},
          .theta_degrees =
              node.normal.empty() ? 0 : std::max(options_.theta.start_degrees, theta_reached),
          .grid = used.cells,
          .theta_relaxed = theta_reached > options_.theta.start_degrees,
          .grid_coarsened = used.coarsened};
}

}  // namespace cairn::stages
