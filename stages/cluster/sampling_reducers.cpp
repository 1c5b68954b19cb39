#include "stages/cluster/sampling_reducers.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "formats/error.h"
#include "stages/cluster/center_tree.h"
#include "stages/cluster/numbering.h"
#include "stages/cluster/places.h"
#include "stages/mix.h"
#include "stages/vector_path.h"

namespace cairn::stages {
namespace {

/// Points along the curve.
std::vector<std::uint32_t> first_of_runs(const NodeView& node, std::uint64_t quota) {
  const std::uint64_t count = node.position.size();
  std::vector<std::uint32_t> chosen;
  chosen.reserve(quota);
  for (std::uint64_t run = 0; run < quota; ++run)
    chosen.push_back(node.curve.order[run * count / quota]);
  return chosen;
}

/// Points along the curve.
std::vector<std::uint32_t> any_of(const NodeView& node, std::uint64_t quota) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> lots;
  lots.reserve(node.position.size());
  for (std::uint32_t i = 0; i < node.position.size(); ++i)
    lots.emplace_back(mix(formats::value_of(node.id), i), i);
  std::nth_element(lots.begin(), lots.begin() + static_cast<std::ptrdiff_t>(quota) - 1, lots.end());
  std::vector<bool> drawn(lots.size());
  for (std::uint64_t k = 0; k < quota; ++k) drawn[lots[k].second] = true;
  std::vector<std::uint32_t> chosen;
  chosen.reserve(quota);
  std::ranges::copy_if(node.curve.order, std::back_inserter(chosen),
                       [&](std::uint32_t point) { return drawn[point]; });
  return chosen;
}

/// For each point which of the chosen, which follow the curve, is nearest; of a chosen one itself.
std::vector<std::uint32_t> nearest_of(const NodeView& node,
                                      const std::vector<std::uint32_t>& chosen) {
  const Places places(node);
  std::vector<Location> centers;
  centers.reserve(chosen.size());
  for (const std::uint32_t point : chosen) centers.push_back(places[point]);
  const CenterTree tree(centers);
  std::vector<std::uint32_t> nearest(node.position.size());
  std::uint32_t latest = 0;  // of the chosen, on the way along the curve
  for (const std::uint32_t point : node.curve.order) {
    if (latest + 1 < chosen.size() && chosen[latest + 1] == point) ++latest;
    const Location place = places[point];
    nearest[point] = latest;
    tree.search(place, squared_distance(place, centers[latest]),
                [&](std::uint32_t r, double square) {
                  nearest[point] = r;
                  return square;
                });
  }
  for (std::uint32_t r = 0; r < chosen.size(); ++r) nearest[chosen[r]] = r;
  return nearest;
}

}  // namespace

Reduction SamplingReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  CAIRN_CHECK(quota >= 1 && quota <= node.position.size());
  const std::vector<std::uint32_t> chosen =
      pick_ == Pick::kFirst ? first_of_runs(node, quota) : any_of(node, quota);
  Reduction reduction;
  reduction.representative = vectorized<nearest_of>(node, chosen);
  reduction.chosen.reserve(quota);
  for (const std::uint32_t old : number_along(node.curve.order, quota, reduction.representative))
    reduction.chosen.push_back(chosen[old]);
  return reduction;
}

}  // namespace cairn::stages
