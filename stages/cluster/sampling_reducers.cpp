#include "stages/cluster/sampling_reducers.h"

#include <algorithm>
#include <utility>

#include "formats/error.h"
#include "stages/cluster/center_tree.h"
#include "stages/cluster/curve_points.h"
#include "stages/cluster/numbering.h"
#include "stages/mix.h"

namespace cairn::stages {
namespace {

/// Places on the curve.
std::vector<std::uint32_t> first_of_runs(const NodeView& node, std::uint64_t quota) {
  const std::uint64_t count = node.position.size();
  std::vector<std::uint32_t> chosen;
  chosen.reserve(quota);
  for (std::uint64_t run = 0; run < quota; ++run)
    chosen.push_back(static_cast<std::uint32_t>(run * count / quota));
  return chosen;
}

/// Places on the curve.
std::vector<std::uint32_t> any_of(const NodeView& node, std::uint64_t quota) {
  const auto& order = node.curve.order;
  std::vector<std::uint64_t> lots;
  lots.reserve(order.size());
  for (const std::uint32_t point : order) lots.push_back(mix(formats::value_of(node.id), point));
  std::vector<std::uint64_t> sorted(lots);
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(quota) - 1,
                   sorted.end());
  const std::uint64_t highest = sorted[quota - 1];
  std::vector<std::uint32_t> chosen;
  chosen.reserve(quota);
  // A mix of different numbers is different.
  for (std::uint32_t place = 0; place < lots.size(); ++place)
    if (lots[place] <= highest) chosen.push_back(place);
  return chosen;
}

/// For each point along the curve which of the chosen is nearest; of a chosen one itself.
std::vector<std::uint32_t> nearest_of(const CurvePoints& points,
                                      const std::vector<std::uint32_t>& chosen) {
  CurvePoints centers;
  for (std::vector<double>* column : {&centers.x, &centers.y, &centers.z})
    column->reserve(chosen.size());
  for (const std::uint32_t place : chosen) {
    centers.x.push_back(points.x[place]);
    centers.y.push_back(points.y[place]);
    centers.z.push_back(points.z[place]);
  }
  std::vector<std::uint32_t> nearest(points.count());
  std::uint32_t latest = 0;  // of the chosen, on the way along the curve
  for (std::uint32_t place = 0; place < nearest.size(); ++place) {
    if (latest + 1 < chosen.size() && chosen[latest + 1] == place) ++latest;
    nearest[place] = latest;
  }
  CenterTree(std::move(centers)).move_to_nearest(points, -1, nearest);
  for (std::uint32_t r = 0; r < chosen.size(); ++r) nearest[chosen[r]] = r;
  return nearest;
}

}  // namespace

Reduction SamplingReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  CAIRN_CHECK(quota >= 1 && quota <= node.position.size());
  const std::vector<std::uint32_t> chosen =
      pick_ == Pick::kFirst ? first_of_runs(node, quota) : any_of(node, quota);
  Reduction reduction;
  NodeView without_normals = node;
  without_normals.normal = {};
  std::vector<std::uint32_t> nearest = nearest_of(points_along_curve(without_normals), chosen);
  reduction.chosen.reserve(quota);
  for (const std::uint32_t old : number_along(quota, nearest))
    reduction.chosen.push_back(node.curve.order[chosen[old]]);
  reduction.representative = by_point(node.curve, nearest);
  return reduction;
}

}  // namespace cairn::stages
