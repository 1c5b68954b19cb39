#include "stages/cluster/reducer.h"

#include <array>
#include <string>

#include "formats/error.h"
#include "stages/cluster/cluster_reducer.h"
#include "stages/cluster/grid_reducer.h"
#include "stages/cluster/sampling_reducers.h"

namespace cairn::stages {

std::span<const std::string_view> reducer_names() {
  static constexpr std::array<std::string_view, 5> kNames{"cluster", "average", "weighted", "first",
                                                          "random"};
  return kNames;
}

std::unique_ptr<Reducer> make_reducer(std::string_view name, const ClusterOptions& options) {
  if (name == "cluster") return std::make_unique<ClusterReducer>(options);
  if (name == "average") return std::make_unique<GridReducer>(GridReducer::Filter::kCell);
  if (name == "weighted") return std::make_unique<GridReducer>(GridReducer::Filter::kReach);
  if (name == "first") return std::make_unique<SamplingReducer>(SamplingReducer::Pick::kFirst);
  if (name == "random") return std::make_unique<SamplingReducer>(SamplingReducer::Pick::kRandom);
  formats::throw_usage("unknown reducer '" + std::string(name) +
                       "': expected cluster, average, weighted, first or random");
}

}  // namespace cairn::stages
