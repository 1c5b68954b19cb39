#include "stages/cluster/reducer.h"

#include <string>

#include "formats/error.h"
#include "stages/cluster/cluster_reducer.h"
#include "stages/cluster/sampling_reducers.h"

namespace cairn::stages {

std::unique_ptr<Reducer> make_reducer(std::string_view name, const ClusterOptions& options) {
  if (name == "cluster") return std::make_unique<ClusterReducer>(options);
  if (name == "first") return std::make_unique<SamplingReducer>(SamplingReducer::Pick::kFirst);
  if (name == "random") return std::make_unique<SamplingReducer>(SamplingReducer::Pick::kRandom);
  formats::throw_usage("unknown reducer '" + std::string(name) +
                       "': expected cluster, first or random");
}

}  // namespace cairn::stages
