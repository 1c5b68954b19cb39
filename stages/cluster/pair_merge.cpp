#include "stages/cluster/pair_merge.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "stages/cluster/normals.h"
#include "stages/vector_path.h"

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

/// Fills the last lanes with numbers, whatever they are.
void pad(MergeList& list) {
  for (std::uint32_t j = list.count; j % kLanes != 0; ++j) {
    list.x[j] = list.y[j] = list.z[j] = 0;
    list.area[j] = 1;
    list.nx[j] = list.ny[j] = list.nz[j] = 0;
  }
}

/// For each cluster of a padded list the key of the pair with its cheapest partner within the threshold, or kBlocked.
/// Costs and the threshold are the same seen from both clusters of a pair, bit by bit: otherwise partners could form a
/// ring in which no two choose each other.
void find_partners(const MergeList& list, float min_cosine, Keys& partner) {
  for (std::uint32_t first = 0; first < list.count; first += kLanes) {
    alignas(64) std::array<std::int32_t, kLanes> best;
    best.fill(kBlocked);
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const float x = list.x[j], y = list.y[j], z = list.z[j], area = list.area[j];
      const float nx = list.nx[j], ny = list.ny[j], nz = list.nz[j];
      const float own = nx * nx + ny * ny + nz * nz;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t i = first + lane;
        const float dx = list.x[i] - x, dy = list.y[i] - y, dz = list.z[i] - z;
        const float cost =
            (dx * dx + dy * dy + dz * dz) * ((area * list.area[i]) / (area + list.area[i]));
        const float dot = list.nx[i] * nx + list.ny[i] * ny + list.nz[i] * nz;
        const float other =
            list.nx[i] * list.nx[i] + list.ny[i] * list.ny[i] + list.nz[i] * list.nz[i];
        // A missing normal makes both sides zero.
        const float limit = own * other > 0.25F ? min_cosine : -2.0F;
        const auto parted = static_cast<std::int32_t>(i ^ j);
        const std::int32_t key = (std::bit_cast<std::int32_t>(cost) & ~kIndexMask) | parted;
        const std::int32_t allowed = dot >= limit && parted != 0 ? key : kBlocked;
        best[lane] = std::min(best[lane], allowed);
      }
    }
    std::copy(best.begin(), best.end(), partner.begin() + first);
  }
}

void merge_into(MergeList& list, std::uint32_t a, std::uint32_t b) {
  const float wa = list.weight[a], wb = list.weight[b], w = wa + wb;
  list.x[a] = (wa * list.x[a] + wb * list.x[b]) / w;
  list.y[a] = (wa * list.y[a] + wb * list.y[b]) / w;
  list.z[a] = (wa * list.z[a] + wb * list.z[b]) / w;
  list.weight[a] = w;
  list.area[a] += list.area[b];
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

void copy_entry(MergeList& list, std::uint32_t from, std::uint32_t to) {
  list.x[to] = list.x[from];
  list.y[to] = list.y[from];
  list.z[to] = list.z[from];
  list.weight[to] = list.weight[from];
  list.area[to] = list.area[from];
  list.cost[to] = list.cost[from];
  list.nx[to] = list.nx[from];
  list.ny[to] = list.ny[from];
  list.nz[to] = list.nz[from];
  list.id[to] = list.id[from];
}

void remove_marked(MergeList& list, const std::array<bool, kMaxListLength>& removed) {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < list.count; ++i) {
    if (removed[i]) continue;
    if (kept != i) copy_entry(list, i, kept);
    ++kept;
  }
  list.count = kept;
}

std::uint32_t index_in(std::int32_t key) { return static_cast<std::uint32_t>(key & kIndexMask); }

std::uint32_t partner_of(std::uint32_t i, const Keys& partner) { return i ^ index_in(partner[i]); }

float cost_in(std::int32_t key) { return std::bit_cast<float>(key & ~kIndexMask); }

/// The first pair of all: the cheapest, then the one of the smallest index. Its smaller index, with the
/// greater as its partner; requires that some cluster has a partner.
std::uint32_t first_pair(const MergeList& list, Keys& partner) {
  const auto best = static_cast<std::uint32_t>(
      std::min_element(partner.begin(), partner.begin() + list.count) - partner.begin());
  const std::uint32_t other = partner_of(best, partner);
  partner[other] = partner[best];
  return std::min(best, other);
}

/// Pairs that are each other's cheapest partner, as keys of (cost, first), ascending: at least one, unless
/// all are blocked.
std::uint32_t reciprocal_pairs(MergeList& list, float min_cosine, Keys& partner, Keys& pairs) {
  pad(list);
  find_partners(list, min_cosine, partner);
  std::uint32_t found = 0;
  bool blocked = true;
  for (std::uint32_t i = 0; i < list.count; ++i) {
    if (partner[i] == kBlocked) continue;
    blocked = false;
    const std::uint32_t j = partner_of(i, partner);
    if (j > i && partner[j] != kBlocked && partner_of(j, partner) == i)
      pairs[found++] = (partner[i] & ~kIndexMask) | static_cast<std::int32_t>(i);
  }
  // Cannot happen while both sides see one cost; progress must not hang on how a compiler rounds.
  if (found == 0 && !blocked) pairs[found++] = static_cast<std::int32_t>(first_pair(list, partner));
  std::sort(pairs.begin(), pairs.begin() + found);
  return found;
}

MergeOutcome merge(MergeList& list, std::uint32_t target, ThetaRule theta) {
  MergeOutcome outcome;
  float theta_degrees = theta.start_degrees, penalty = 1;
  float min_cosine = cosine_of_limit(theta.start_degrees);
  Keys partner, pairs;
  while (list.count > target) {
    const std::uint32_t found = reciprocal_pairs(list, min_cosine, partner, pairs);
    ++outcome.rounds;
    if (found == 0) {
      theta_degrees = std::min(
          180.0F, std::max(theta_degrees * theta.relaxation, theta_degrees + kLeastRelaxation));
      const float relaxed = theta_degrees / std::max(theta.start_degrees, kLeastRelaxation);
      penalty = relaxed * relaxed;
      min_cosine = cosine_of_limit(theta_degrees);
      continue;
    }
    const std::uint32_t merging = std::min(found, list.count - target);
    std::array<bool, kMaxListLength> removed{};
    for (std::uint32_t k = 0; k < merging; ++k) {
      const std::uint32_t a = index_in(pairs[k]), b = partner_of(a, partner);
      merge_into(list, a, b);
      list.cost[a] = std::max({cost_in(pairs[k]) * penalty, list.cost[a], list.cost[b]});
      removed[b] = true;
      outcome.merges[outcome.count++] = {list.id[a], list.id[b], list.cost[a], theta_degrees};
    }
    remove_marked(list, removed);
  }
  return outcome;
}

}  // namespace

MergeOutcome merge_pairs(MergeList& list, std::uint32_t target, ThetaRule theta) {
  return vectorized<merge>(list, target, theta);
}

}  // namespace cairn::stages
