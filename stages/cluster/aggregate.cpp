#include "stages/cluster/aggregate.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

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

/// floor(a / b + 1/2) for b > 0.
template <typename Wide>
std::int64_t divide_rounded(Wide a, std::uint64_t b) {
  const Wide twice = 2 * a + static_cast<Wide>(b), divisor = 2 * static_cast<Wide>(b);
  const Wide quotient = twice / divisor;
  return static_cast<std::int64_t>(twice % divisor < 0 ? quotient - 1 : quotient);
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
    if (fits_64_bits())
      merge_geometry<std::int64_t>();
    else
      merge_geometry<Int128>();
    merge_attributes();
    out_.theta = in_.reduction.theta_degrees;
    out_.grid = in_.reduction.grid;
    out_.numerics.relaxed_theta = in_.reduction.theta_relaxed ? 1 : 0;
    out_.numerics.coarsened_grid = in_.reduction.grid_coarsened ? 1 : 0;
    return std::move(out_);
  }

 private:
  bool sampled() const { return !in_.reduction.chosen.empty(); }

  /// Whether all sums of steps and of their squares stay below 2^62.
  bool fits_64_bits() const {
    const formats::GridBox box = formats::box_of(node_.data.position);
    Uint128 extent = 1, weight = node_.data.weight.empty() ? node_.count() : 0;
    for (int axis = 0; axis < 3; ++axis)
      extent = std::max<Uint128>(extent, Uint128{box.span(axis)} + 1);
    for (const std::uint64_t w : node_.data.weight) weight += w;
    std::uint64_t residual = 0;
    for (const Steps& steps : node_.residual)
      for (const std::int64_t r : steps) {
        const auto bits = static_cast<std::uint64_t>(r);
        residual = std::max(residual, r < 0 ? 0 - bits : bits);
      }
    // The greatest sum is that of 2 d residual + weight d^2, where no d is above the extent.
    constexpr Uint128 kLimit = Uint128{1} << 62;
    const Uint128 residuals = Uint128{residual} * node_.count() * 2;
    return weight < kLimit / extent / extent / 4 && residuals < kLimit / extent / 4;
  }

  template <typename Wide>
  void merge_geometry() {
    if (node_.data.weight.empty() && node_.residual.empty() && node_.bound.empty())
      for (std::size_t r = 0; r < in_.quota; ++r) merge_geometry<Wide, true>(r);
    else
      for (std::size_t r = 0; r < in_.quota; ++r) merge_geometry<Wide, false>(r);
  }

  /// The input points of a point; each point of a leaf is one.
  template <bool kLeaf>
  std::uint64_t weight_of(std::size_t i) const {
    if constexpr (kLeaf) return 1;
    return node_.weight_of(i);
  }
  template <bool kLeaf>
  Steps residual_of(std::size_t i) const {
    if constexpr (kLeaf) return {};
    return node_.residual.empty() ? Steps{} : node_.residual[i];
  }

  template <typename Wide, bool kLeaf>
  GridPoint mean_position(std::span<const std::uint32_t> points, std::uint64_t weight) const {
    const GridPoint& origin = node_.data.position[points[0]];
    std::array<Wide, 3> sum{};
    for (const std::uint32_t i : points) {
      const Steps d = difference(node_.data.position[i], origin);
      const Steps residual = residual_of<kLeaf>(i);
      const auto w = static_cast<Wide>(weight_of<kLeaf>(i));
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += w * d[axis] + residual[axis];
    }
    GridPoint mean;
    for (std::size_t axis = 0; axis < 3; ++axis)
      mean[axis] = static_cast<std::int32_t>(origin[axis] + divide_rounded(sum[axis], weight));
    return mean;
  }

  template <typename Wide, bool kLeaf>
  void merge_geometry(std::size_t r) {
    const auto points = members_.of(r);
    std::uint64_t weight = 0;
    double squared_radii = 0;
    for (const std::uint32_t i : points) {
      weight += weight_of<kLeaf>(i);
      squared_radii += double{node_.data.radius[i]} * node_.data.radius[i];
    }
    const GridPoint position = sampled() ? node_.data.position[in_.reduction.chosen[r]]
                                         : mean_position<Wide, kLeaf>(points, weight);
    out_.data.position[r] = position;
    out_.data.weight[r] = weight;
    out_.data.radius[r] = merged_radius(squared_radii);
    account_for<Wide, kLeaf>(points, r, position);
  }

  /// What it adds to the errors that representative r stands for points.
  template <typename Wide, bool kLeaf>
  void account_for(std::span<const std::uint32_t> points, std::size_t r,
                   const GridPoint& position) {
    std::array<Wide, 3> grown{};
    Steps sum{};
    double bound = 0, reach = 0;
    for (const std::uint32_t i : points) {
      const Steps d = difference(node_.data.position[i], position);
      const Steps residual = residual_of<kLeaf>(i);
      const std::uint64_t weight = weight_of<kLeaf>(i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // sum (x - P)^2 = sum (x - p)^2 + 2 d sum (x - p) + w d^2; the first term is counted already.
        const auto wide = static_cast<Wide>(d[axis]);
        grown[axis] += 2 * wide * residual[axis] + static_cast<Wide>(weight) * (wide * wide);
        // Single terms may pass 2^63; the total does not, so that adding modulo 2^64 gives it exactly.
        sum[axis] = static_cast<std::int64_t>(static_cast<std::uint64_t>(sum[axis]) +
                                              static_cast<std::uint64_t>(residual[axis]) +
                                              weight * static_cast<std::uint64_t>(d[axis]));
      }
      const double distance =
          std::sqrt(squared_distance(in_.grid, node_.data.position[i], position)) * kRoundUp;
      const double inner = kLeaf || node_.bound.empty() ? 0 : node_.bound[i];
      bound = std::max(bound, (distance + inner) * kRoundUp);
      reach =
          std::max(reach, (distance + in_.displacement + double{in_.decoded_radius[i]}) * kRoundUp);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      out_.squared_steps[axis] += static_cast<Uint128>(grown[axis]);
    out_.residual[r] = sum;
    out_.bound[r] = bound;
    out_.reach[r] = reach;
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
          sum[c] +=
              node_.normal_sum.empty() ? normal_units(node_.normal[i][c]) : node_.normal_sum[i][c];
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

  /// Rounded half away from zero; no product of a float and a power of two is so near to a half that adding one errs.
  static std::int64_t normal_units(float component) {
    const double units = double{component} * kNormalUnits;
    return static_cast<std::int64_t>(units + (units < 0 ? -0.5 : 0.5));
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
    out_.mean_sum[a].resize(in_.quota * attribute.components);
    out_.data.attributes[a].resize(in_.quota * attribute.size_bytes());
    formats::with_scalar_type(attribute.type,
                              [&]<typename T>(T) { merge_means<T>(a, attribute.components); });
    if (sampled())
      for (std::size_t r = 0; r < in_.quota; ++r) copy_value(a, r, in_.reduction.chosen[r]);
  }

  template <typename T>
  void merge_means(std::size_t a, std::size_t components) {
    std::byte* const to = out_.data.attributes[a].data();
    for (std::size_t r = 0; r < in_.quota; ++r)
      for (std::size_t c = 0; c < components; ++c) {
        const std::size_t at = r * components + c;
        const double sum = blended(r) ? blended_sum<T>(a, c, r) : sum_of_members<T>(a, c, r);
        out_.mean_sum[a][at] = sum;
        const double mean = sum / static_cast<double>(out_.data.weight[r]);
        const double stored = std::is_integral_v<T> ? std::floor(mean + 0.5) : mean;
        formats::store_le(to + at * sizeof(T), static_cast<T>(stored));
      }
  }

  bool blended(std::size_t r) const {
    return !in_.reduction.blend.empty() && !in_.reduction.blend[r].empty();
  }

  /// The sum over a point's input points of component c of attribute a, whose type is T.
  template <typename T>
  double sum_of_point(std::size_t a, std::size_t c, std::uint32_t i) const {
    const std::size_t at = std::size_t{i} * in_.schema[a].components + c;
    if (!node_.mean_sum.empty()) return node_.mean_sum[a][at];
    return static_cast<double>(
        formats::load_le<T>(node_.data.attributes[a].data() + at * sizeof(T)));
  }

  template <typename T>
  double sum_of_members(std::size_t a, std::size_t c, std::size_t r) const {
    double sum = 0;
    for (const std::uint32_t i : members_.of(r)) sum += sum_of_point<T>(a, c, i);
    return sum;
  }

  /// The mean over the shares, as a sum over the input points that the representative stands for.
  template <typename T>
  double blended_sum(std::size_t a, std::size_t c, std::size_t r) const {
    double sum = 0, weight = 0;
    for (const auto& [point, factor] : in_.reduction.blend[r]) {
      sum += factor * sum_of_point<T>(a, c, point);
      weight += factor * static_cast<double>(node_.weight_of(point));
    }
    return sum / weight * static_cast<double>(out_.data.weight[r]);
  }

  void merge_majority(std::size_t a) {
    const Attribute& attribute = in_.schema[a];
    const std::size_t size = attribute.size_bytes();
    const std::byte* const values = node_.data.attributes[a].data();
    out_.data.attributes[a].resize(in_.quota * size);
    // Most attributes with this rule hardly change from point to point.
    const std::size_t rest = node_.data.attributes[a].size() - size;
    const bool constant = std::memcmp(values, values + size, rest) == 0;
    std::vector<std::pair<double, std::uint32_t>> votes;
    for (std::size_t r = 0; r < in_.quota; ++r) {
      const auto points = members_.of(r);
      if (sampled() || constant || all_alike(values, size, points)) {
        copy_value(a, r, sampled() ? in_.reduction.chosen[r] : points[0]);
        continue;
      }
      votes.clear();
      for (const std::uint32_t i : points)
        votes.emplace_back(formats::load_scalar(values + i * size, attribute.type), i);
      copy_value(a, r, winner_of(votes));
    }
  }

  static bool all_alike(const std::byte* values, std::size_t size,
                        std::span<const std::uint32_t> points) {
    const std::byte* const first = values + points[0] * size;
    return std::ranges::all_of(
        points, [&](std::uint32_t i) { return std::memcmp(values + i * size, first, size) == 0; });
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
