#include "stages/cluster/sampling_reducers.h"

#include "formats/error.h"
#include "stages/mix.h"

namespace cairn::stages {

Reduction SamplingReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  const std::uint64_t count = node.position.size();
  CAIRN_CHECK(quota >= 1 && quota <= count);
  Reduction reduction;
  reduction.representative.resize(count);
  reduction.chosen.reserve(quota);
  for (std::uint64_t run = 0; run < quota; ++run) {
    const std::uint64_t first = run * count / quota, last = (run + 1) * count / quota;
    for (std::uint64_t i = first; i < last; ++i)
      reduction.representative[node.curve.order[i]] = static_cast<std::uint32_t>(run);
    const std::uint64_t pick =
        pick_ == Pick::kFirst ? 0 : mix(formats::value_of(node.id), run) % (last - first);
    reduction.chosen.push_back(node.curve.order[first + pick]);
  }
  return reduction;
}

}  // namespace cairn::stages
