#include "stages/cluster/aggregate.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/error.h"
#include "formats/scalar_value.h"
#include "stages/cluster/normals.h"
#include "stages/cluster/splat_radius.h"

namespace cairn::stages {

using formats::Attribute;
using formats::GridPoint;
using formats::Int128;
using formats::Normal;
using formats::ReduceRule;
using formats::Uint128;

namespace {

/// Covers the rounding of a square root of sums of products, so that bounds stay bounds.
constexpr double kRoundUp = 1 + 1e-12;

/// floor(a / b) for b > 0.
template <typename Integer>
std::int64_t floor_of_quotient(Integer a, Integer b) {
  const Integer quotient = a / b;
  return static_cast<std::int64_t>(a % b < 0 ? quotient - 1 : quotient);
}

/// floor(a / b + 1/2) for b > 0.
std::int64_t divide_rounded(Int128 a, std::uint64_t b) {
  const Int128 twice = 2 * a + static_cast<Int128>(b);
  const Int128 divisor = 2 * static_cast<Int128>(b);
  // Processors divide shorter integers several times as fast.
  const auto short_twice = static_cast<std::int64_t>(twice);
  const auto short_divisor = static_cast<std::int64_t>(divisor);
  if (short_twice == twice && short_divisor == divisor)
    return floor_of_quotient(short_twice, short_divisor);
  return floor_of_quotient(twice, divisor);
}

Steps difference(const GridPoint& a, const GridPoint& b) {
  Steps d;
  for (std::size_t axis = 0; axis < 3; ++axis) d[axis] = std::int64_t{a[axis]} - b[axis];
  return d;
}

/// The points that each representative stands for, by counting sort: [start[r], start[r + 1]).
struct Members {
  std::vector<std::uint32_t> start;
  std::vector<std::uint32_t> point;

  std::span<const std::uint32_t> of(std::size_t r) const {
    return std::span(point).subspan(start[r], start[r + 1] - start[r]);
  }
};

Members list_members(std::span<const std::uint32_t> representative, std::uint64_t quota) {
  Members members{std::vector<std::uint32_t>(quota + 1),
                  std::vector<std::uint32_t>(representative.size())};
  for (const std::uint32_t r : representative) {
    CAIRN_CHECK(r < quota);
    ++members.start[r + 1];
  }
  for (std::size_t r = 0; r < quota; ++r) {
    CAIRN_CHECK(members.start[r + 1] > 0);
    members.start[r + 1] += members.start[r];
  }
  std::vector<std::uint32_t> next(members.start.begin(), members.start.end() - 1);
  for (std::uint32_t i = 0; i < representative.size(); ++i)
    members.point[next[representative[i]]++] = i;
  return members;
}

class Aggregator {
 public:
  explicit Aggregator(const AggregateInput& input)
      : in_(input),
        node_(input.node),
        members_(list_members(input.reduction.representative, input.quota)) {}

  WorkingNode run() {
    const std::size_t quota = in_.quota;
    out_.data.position.resize(quota);
    out_.data.weight.resize(quota);
    out_.data.radius.resize(quota);
    out_.residual.resize(quota);
    out_.bound.resize(quota);
    out_.reach.resize(quota);
    out_.squared_steps = node_.squared_steps;
    for (std::size_t r = 0; r < quota; ++r) merge_geometry(r);
    merge_attributes();
    out_.theta = in_.reduction.theta_degrees;
    out_.grid = in_.reduction.grid;
    out_.numerics.relaxed_theta = in_.reduction.theta_relaxed ? 1 : 0;
    out_.numerics.coarsened_grid = in_.reduction.grid_coarsened ? 1 : 0;
    return std::move(out_);
  }

 private:
  bool sampled() const { return !in_.reduction.chosen.empty(); }

  GridPoint mean_position(std::span<const std::uint32_t> points, std::uint64_t weight) const {
    const GridPoint& origin = node_.data.position[points[0]];
    std::array<Int128, 3> sum{};
    for (const std::uint32_t i : points) {
      const Steps d = difference(node_.data.position[i], origin);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sum[axis] += static_cast<Int128>(node_.weight_of(i)) * d[axis];
        if (!node_.residual.empty()) sum[axis] += node_.residual[i][axis];
      }
    }
    GridPoint mean;
    for (std::size_t axis = 0; axis < 3; ++axis)
      mean[axis] = static_cast<std::int32_t>(origin[axis] + divide_rounded(sum[axis], weight));
    return mean;
  }

  void merge_geometry(std::size_t r) {
    const auto points = members_.of(r);
    std::uint64_t weight = 0;
    double squared_radii = 0;
    for (const std::uint32_t i : points) {
      weight += node_.weight_of(i);
      squared_radii += double{node_.data.radius[i]} * node_.data.radius[i];
    }
    const GridPoint position =
        sampled() ? node_.data.position[in_.reduction.chosen[r]] : mean_position(points, weight);
    out_.data.position[r] = position;
    out_.data.weight[r] = weight;
    out_.data.radius[r] = merged_radius(squared_radii);
    for (const std::uint32_t i : points) account_for(i, r, position);
  }

  /// What it adds to the errors that representative r stands for point i.
  void account_for(std::uint32_t i, std::size_t r, const GridPoint& position) {
    const Steps d = difference(node_.data.position[i], position);
    const std::uint64_t weight = node_.weight_of(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t residual = node_.residual.empty() ? 0 : node_.residual[i][axis];
      // sum (x - P)^2 = sum (x - p)^2 + 2 d sum (x - p) + w d^2; the first term is counted already.
      const Int128 grown = 2 * static_cast<Int128>(d[axis]) * residual +
                           static_cast<Int128>(weight) * (static_cast<Int128>(d[axis]) * d[axis]);
      out_.squared_steps[axis] += static_cast<Uint128>(grown);
      // Single terms may pass 2^63; the total does not, so that adding modulo 2^64 gives it exactly.
      out_.residual[r][axis] = static_cast<std::int64_t>(
          static_cast<std::uint64_t>(out_.residual[r][axis]) +
          static_cast<std::uint64_t>(residual) + weight * static_cast<std::uint64_t>(d[axis]));
    }
    const double distance =
        std::sqrt(squared_distance(in_.grid, node_.data.position[i], position)) * kRoundUp;
    const double inner = node_.bound.empty() ? 0 : node_.bound[i];
    out_.bound[r] = std::max(out_.bound[r], (distance + inner) * kRoundUp);
    out_.reach[r] = std::max(
        out_.reach[r], (distance + in_.displacement + double{in_.decoded_radius[i]}) * kRoundUp);
  }

  void merge_attributes() {
    out_.data.attributes.resize(in_.schema.size());
    out_.mean_sum.resize(in_.schema.size());
    for (std::size_t a = 0; a < in_.schema.size(); ++a) {
      if (in_.schema[a].rule == ReduceRule::kNormal) merge_normals(a);
      if (in_.schema[a].rule == ReduceRule::kMean) merge_means(a);
      if (in_.schema[a].rule == ReduceRule::kMajority) merge_majority(a);
    }
  }

  void copy_value(std::size_t a, std::size_t r, std::uint32_t point) {
    const std::size_t size = in_.schema[a].size_bytes();
    std::memcpy(out_.data.attributes[a].data() + r * size,
                node_.data.attributes[a].data() + point * size, size);
  }

  void merge_normals(std::size_t a) {
    const Attribute& attribute = in_.schema[a];
    out_.normal.resize(in_.quota);
    out_.normal_sum.resize(in_.quota);
    out_.data.attributes[a].resize(in_.quota * attribute.size_bytes());
    for (std::size_t r = 0; r < in_.quota; ++r) {
      Steps sum{};
      std::uint32_t heaviest = members_.of(r)[0];
      for (const std::uint32_t i : members_.of(r)) {
        for (std::size_t c = 0; c < 3; ++c)
          sum[c] += node_.normal_sum.empty()
                        ? std::llround(double{node_.normal[i][c]} * kNormalUnits)
                        : node_.normal_sum[i][c];
        if (node_.weight_of(i) > node_.weight_of(heaviest)) heaviest = i;
      }
      out_.normal_sum[r] = sum;
      out_.normal[r] = sampled() ? node_.normal[in_.reduction.chosen[r]]
                                 : mean_normal(sum, out_.data.weight[r], node_.normal[heaviest]);
      for (std::size_t c = 0; c < 3; ++c)
        formats::store_scalar(out_.data.attributes[a].data() + r * attribute.size_bytes() +
                                  c * formats::size_bytes(attribute.type),
                              attribute.type, double{out_.normal[r][c]});
    }
  }

  /// The unit vector along `sum`, or `fallback` where the normals cancel to a thousandth.
  Normal mean_normal(const Steps& sum, std::uint64_t weight, const Normal& fallback) {
    const double x = static_cast<double>(sum[0]), y = static_cast<double>(sum[1]),
                 z = static_cast<double>(sum[2]);
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!(length > kCancelled * kNormalUnits * static_cast<double>(weight))) {
      out_.numerics.cancelled_normals += fallback == Normal{0, 0, 0} ? 0 : 1;
      return fallback;
    }
    return {static_cast<float>(x / length), static_cast<float>(y / length),
            static_cast<float>(z / length)};
  }

  void merge_means(std::size_t a) {
    const Attribute& attribute = in_.schema[a];
    const std::size_t scalar = formats::size_bytes(attribute.type);
    const bool integer =
        attribute.type != formats::ScalarType::kF32 && attribute.type != formats::ScalarType::kF64;
    out_.mean_sum[a].resize(in_.quota * attribute.components);
    out_.data.attributes[a].resize(in_.quota * attribute.size_bytes());
    for (std::size_t r = 0; r < in_.quota; ++r) {
      for (std::size_t c = 0; c < attribute.components; ++c) {
        const double sum = blended(r) ? blended_sum(a, c, r) : sum_of_members(a, c, r);
        const std::size_t at = r * attribute.components + c;
        out_.mean_sum[a][at] = sum;
        const double mean = sum / static_cast<double>(out_.data.weight[r]);
        formats::store_scalar(out_.data.attributes[a].data() + at * scalar, attribute.type,
                              integer ? std::floor(mean + 0.5) : mean);
      }
      if (sampled()) copy_value(a, r, in_.reduction.chosen[r]);
    }
  }

  bool blended(std::size_t r) const {
    return !in_.reduction.blend.empty() && !in_.reduction.blend[r].empty();
  }

  /// The sum over a point's input points of component c of attribute a.
  double sum_of_point(std::size_t a, std::size_t c, std::uint32_t i) const {
    const Attribute& attribute = in_.schema[a];
    const std::size_t at = std::size_t{i} * attribute.components + c;
    if (!node_.mean_sum.empty()) return node_.mean_sum[a][at];
    return formats::load_scalar(
        node_.data.attributes[a].data() + at * formats::size_bytes(attribute.type), attribute.type);
  }

  double sum_of_members(std::size_t a, std::size_t c, std::size_t r) const {
    double sum = 0;
    for (const std::uint32_t i : members_.of(r)) sum += sum_of_point(a, c, i);
    return sum;
  }

  /// The mean over the shares, as a sum over the input points that the representative stands for.
  double blended_sum(std::size_t a, std::size_t c, std::size_t r) const {
    double sum = 0, weight = 0;
    for (const auto& [point, factor] : in_.reduction.blend[r]) {
      sum += factor * sum_of_point(a, c, point);
      weight += factor * static_cast<double>(node_.weight_of(point));
    }
    return sum / weight * static_cast<double>(out_.data.weight[r]);
  }

  void merge_majority(std::size_t a) {
    const Attribute& attribute = in_.schema[a];
    out_.data.attributes[a].resize(in_.quota * attribute.size_bytes());
    std::vector<std::pair<double, std::uint32_t>> votes;
    for (std::size_t r = 0; r < in_.quota; ++r) {
      votes.clear();
      for (const std::uint32_t i : members_.of(r))
        votes.emplace_back(
            formats::load_scalar(node_.data.attributes[a].data() + i * attribute.size_bytes(),
                                 attribute.type),
            i);
      copy_value(a, r, sampled() ? in_.reduction.chosen[r] : winner_of(votes));
    }
  }

  /// The point whose value has the greatest weight, the smaller value on a tie.
  std::uint32_t winner_of(std::vector<std::pair<double, std::uint32_t>>& votes) const {
    std::sort(votes.begin(), votes.end());
    std::uint32_t best = votes[0].second;
    std::uint64_t best_weight = 0;
    for (std::size_t first = 0; first < votes.size();) {
      std::size_t last = first;
      std::uint64_t weight = 0;
      while (last < votes.size() && votes[last].first == votes[first].first)
        weight += node_.weight_of(votes[last++].second);
      if (weight > best_weight) {
        best = votes[first].second;
        best_weight = weight;
      }
      first = std::max(last, first + 1);
    }
    return best;
  }

  const AggregateInput& in_;
  const WorkingNode& node_;
  const Members members_;
  WorkingNode out_;
};

}  // namespace

WorkingNode aggregate(const AggregateInput& input) { return Aggregator(input).run(); }

}  // namespace cairn::stages
