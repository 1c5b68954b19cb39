#include "stages/cluster/pair_merge.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/vector_path.h"
#include "stages/cluster/normals.h"

namespace cairn::stages {
namespace {

/// Costs are compared as the bit patterns of non-negative floats, which order like the floats, with the lowest bits
/// replaced by what the indices of the pair differ in (exclusive or): one integer minimum finds cost and partner. Both
/// clusters of a pair see the same key, so that ties, too, leave pairs that choose each other: if they went to the smaller
/// index, a row of points at equal distances would merge one pair a round.
constexpr std::int32_t kIndexMask = kMaxListLength - 1;
constexpr std::int32_t kBlocked = INT32_MAX;
static_assert(std::has_single_bit(kMaxListLength));

/// Degrees by which theta grows at least, so that a factor close to 1 ends too.
constexpr float kLeastRelaxation = 1;

using Keys = std::array<std::int32_t, kMaxListLength>;

/// Clusters whose partners are looked for together: as many as the widest vectors hold.
constexpr std::uint32_t kLanes = 16;
static_assert(kMaxListLength % kLanes == 0);

/// The clusters of a list that are left, ascending.
struct Alive {
  std::array<std::uint16_t, kMaxListLength> index;
  std::uint32_t count;
};

Alive all_of(const MergeList& list) {
  Alive alive{.index = {}, .count = list.count};
  for (std::uint32_t i = 0; i < list.count; ++i) alive.index[i] = static_cast<std::uint16_t>(i);
  return alive;
}

constexpr std::uint32_t vectors_for(std::uint32_t count) { return (count + kLanes - 1) / kLanes; }

/// Fills the last lanes with numbers, whatever they are.
void pad(MergeList& list) {
  for (std::uint32_t j = list.count; j % kLanes != 0; ++j) {
    list.x[j] = list.y[j] = list.z[j] = 0;
    list.area[j] = 1;
    list.nx[j] = list.ny[j] = list.nz[j] = 0;
  }
}

/// For each cluster of a padded list the key of the pair with its cheapest partner among those left within the threshold,
/// or kBlocked. Costs and the threshold are the same seen from both clusters of a pair, bit by bit: otherwise partners
/// could form a ring in which no two choose each other.
template <bool kNormals>
void find_partners(const MergeList& list, const Alive& alive, float min_cosine, Keys& partner) {
  for (std::uint32_t first = 0; first < list.count; first += kLanes) {
    alignas(64) std::array<std::int32_t, kLanes> best;
    best.fill(kBlocked);
    for (std::uint32_t k = 0; k < alive.count; ++k) {
      const std::uint32_t j = alive.index[k];
      const float x = list.x[j], y = list.y[j], z = list.z[j], area = list.area[j];
      const float nx = kNormals ? list.nx[j] : 0, ny = kNormals ? list.ny[j] : 0,
                  nz = kNormals ? list.nz[j] : 0;
      const float own = nx * nx + ny * ny + nz * nz;
#pragma omp simd
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t i = first + lane;
        const float dx = list.x[i] - x, dy = list.y[i] - y, dz = list.z[i] - z;
        const float cost =
            (dx * dx + dy * dy + dz * dz) * ((area * list.area[i]) / (area + list.area[i]));
        const auto parted = static_cast<std::int32_t>(i ^ j);
        const std::int32_t key = (std::bit_cast<std::int32_t>(cost) & ~kIndexMask) | parted;
        // Blocked where they do not part: that is the cluster itself.
        std::int32_t allowed = key | ((parted - 1) >> 31 & kBlocked);
        if constexpr (kNormals) {
          const float dot = list.nx[i] * nx + list.ny[i] * ny + list.nz[i] * nz;
          const float other =
              list.nx[i] * list.nx[i] + list.ny[i] * list.ny[i] + list.nz[i] * list.nz[i];
          // A missing normal makes its product zero. In integers: of conditions GCC makes branches, and no vectors.
          const std::int32_t both = own * other > 0.25F ? kBlocked : 0;
          const std::int32_t apart = dot < min_cosine ? kBlocked : 0;
          allowed |= both & apart;
        }
        best[lane] = std::min(best[lane], allowed);
      }
    }
    std::copy(best.begin(), best.end(), partner.begin() + first);
  }
}

void merge_into(MergeList& list, std::uint32_t a, std::uint32_t b) {
  const float wa = list.weight[a], wb = list.weight[b], w = wa + wb, share = 1 / w;
  list.x[a] = (wa * list.x[a] + wb * list.x[b]) * share;
  list.y[a] = (wa * list.y[a] + wb * list.y[b]) * share;
  list.z[a] = (wa * list.z[a] + wb * list.z[b]) * share;
  list.weight[a] = w;
  list.area[a] += list.area[b];
  if (!list.has_normals) return;
  const float nx = wa * list.nx[a] + wb * list.nx[b];
  const float ny = wa * list.ny[a] + wb * list.ny[b];
  const float nz = wa * list.nz[a] + wb * list.nz[b];
  const float length = std::sqrt(nx * nx + ny * ny + nz * nz);
  // Cancelling normals keep the direction of the first.
  if (length <= static_cast<float>(kCancelled) * w) return;
  list.nx[a] = nx / length;
  list.ny[a] = ny / length;
  list.nz[a] = nz / length;
}

/// Moves those that are left to the front.
void close_gaps(MergeList& list, Alive& alive) {
  const auto close = [&](auto& column) {
    for (std::uint32_t k = 0; k < alive.count; ++k) column[k] = column[alive.index[k]];
  };
  for (auto* column : {&list.x, &list.y, &list.z, &list.weight, &list.area, &list.cost})
    close(*column);
  if (list.has_normals)
    for (auto* column : {&list.nx, &list.ny, &list.nz}) close(*column);
  close(list.id);
  list.count = alive.count;
  alive = all_of(list);
  pad(list);
}

std::uint32_t index_in(std::int32_t key) { return static_cast<std::uint32_t>(key & kIndexMask); }

std::uint32_t partner_of(std::uint32_t i, const Keys& partner) { return i ^ index_in(partner[i]); }

float cost_in(std::int32_t key) { return std::bit_cast<float>(key & ~kIndexMask); }

/// The first pair of all: the cheapest, then the one of the smallest index. Its smaller index, with the
/// greater as its partner; requires that some cluster has a partner.
std::uint32_t first_pair(const Alive& alive, Keys& partner) {
  std::uint32_t best = alive.index[0];
  for (std::uint32_t k = 1; k < alive.count; ++k)
    if (partner[alive.index[k]] < partner[best]) best = alive.index[k];
  const std::uint32_t other = partner_of(best, partner);
  partner[other] = partner[best];
  return std::min(best, other);
}

/// Pairs that are each other's cheapest partner, as keys of (cost, first): at least one, unless all are blocked.
std::uint32_t reciprocal_pairs(const MergeList& list, const Alive& alive, float min_cosine,
                               Keys& partner, Keys& pairs) {
  if (list.has_normals)
    find_partners<true>(list, alive, min_cosine, partner);
  else
    find_partners<false>(list, alive, min_cosine, partner);
  std::uint32_t found = 0;
  bool blocked = true;
  for (std::uint32_t k = 0; k < alive.count; ++k) {
    // Which pairs are reciprocal no processor foresees: no branch may depend on it.
    const std::uint32_t i = alive.index[k], j = partner_of(i, partner);
    const bool is_blocked = partner[i] == kBlocked;
    const bool reciprocal = !is_blocked & (j > i) & (partner[j] == partner[i]);
    pairs[found] = (partner[i] & ~kIndexMask) | static_cast<std::int32_t>(i);
    found += reciprocal ? 1 : 0;
    blocked = blocked & is_blocked;
  }
  // Cannot happen while both sides see one cost; progress must not hang on how a compiler rounds.
  if (found == 0 && !blocked)
    pairs[found++] = static_cast<std::int32_t>(first_pair(alive, partner));
  return found;
}

void remove_marked(Alive& alive, const std::array<bool, kMaxListLength>& removed) {
  std::uint32_t kept = 0;
  for (std::uint32_t k = 0; k < alive.count; ++k) {
    alive.index[kept] = alive.index[k];
    kept += removed[alive.index[k]] ? 0 : 1;
  }
  alive.count = kept;
}

void merge(MergeList& list, std::uint32_t target, ThetaRule theta, MergeOutcome& outcome) {
  float theta_degrees = theta.start_degrees, penalty = 1;
  float min_cosine = cosine_of_limit(theta.start_degrees);
  Keys partner{}, pairs{};
  std::array<bool, kMaxListLength> removed{};
  Alive alive = all_of(list);
  pad(list);
  while (alive.count > target) {
    const std::uint32_t found = reciprocal_pairs(list, alive, min_cosine, partner, pairs);
    ++outcome.rounds;
    if (found == 0) {
      theta_degrees = std::min(
          180.0F, std::max(theta_degrees * theta.relaxation, theta_degrees + kLeastRelaxation));
      const float relaxed = theta_degrees / std::max(theta.start_degrees, kLeastRelaxation);
      penalty = relaxed * relaxed;
      min_cosine = cosine_of_limit(theta_degrees);
      continue;
    }
    const std::uint32_t merging = std::min(found, alive.count - target);
    if (merging < found) std::sort(pairs.begin(), pairs.begin() + found);
    for (std::uint32_t k = 0; k < merging; ++k) {
      const std::uint32_t a = index_in(pairs[k]), b = partner_of(a, partner);
      merge_into(list, a, b);
      list.cost[a] = std::max(std::max(cost_in(pairs[k]) * penalty, list.cost[a]), list.cost[b]);
      removed[b] = true;
      outcome.merges[outcome.count++] = {list.id[a], list.id[b], list.cost[a], theta_degrees};
    }
    remove_marked(alive, removed);
    if (vectors_for(alive.count) == vectors_for(list.count)) continue;
    close_gaps(list, alive);
    removed = {};
  }
}

}  // namespace

MergeOutcome merge_pairs(MergeList& list, std::uint32_t target, ThetaRule theta) {
  MergeOutcome outcome;
  formats::vectorized<merge>(list, target, theta, outcome);
  return outcome;
}

}  // namespace cairn::stages
