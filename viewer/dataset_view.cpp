#include "viewer/dataset_view.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// Threads of the loader take a share of the cache with them.
constexpr std::uint64_t kNodesPerThread = 32;

FrontOptions front_options(const LodTree& tree, const FramePlan& plan, const CacheOptions& cache) {
  const std::uint64_t node_bytes = tree.node_points() * columns_of(plan).point_bytes();
  const std::uint64_t nodes = cache.bytes / node_bytes;
  const auto threads = static_cast<unsigned>(
      std::clamp<std::uint64_t>(nodes / kNodesPerThread, 1, cache.loader_threads));
  const std::uint64_t under_way = Front::nodes_under_way(threads);
  if (nodes <= under_way)
    formats::throw_usage(fmt::format(
        "a cache of {} bytes is too small: drawing takes room for {} nodes, of {} bytes each here",
        cache.bytes, under_way + 1, node_bytes));
  const std::uint64_t kept = nodes - under_way;
  // Renderers number points by 31 bits.
  const std::uint64_t most = std::min<std::uint64_t>(tree.size(), INT32_MAX / tree.node_points());
  const std::uint64_t slots =
      std::min<std::uint64_t>(cache.beside_renderer ? (kept + 1) / 2 : kept, most);
  return {.slots = static_cast<std::uint32_t>(slots),
          .cached_nodes = static_cast<std::size_t>(cache.beside_renderer ? kept - slots : 0),
          .loader_threads = threads,
          .prefetch = cache.prefetch,
          .uploads = cache.uploads,
          .loaded = cache.loaded};
}

/// In a dataset whose children add to their parents, a block would have to stay drawn beside its child.
const formats::DatasetReader& replacing(const formats::DatasetReader& dataset) {
  if (dataset.header().refinement != formats::Refinement::kReplace)
    formats::throw_input({.what = "a dataset whose nodes add to their parents cannot be drawn"});
  return dataset;
}

}  // namespace

std::uint32_t slots_of(const LodTree& tree, const FramePlan& plan, const CacheOptions& cache) {
  return front_options(tree, plan, cache).slots;
}

DatasetView::DatasetView(const formats::DatasetReader& dataset, const LodTree& tree,
                         const FramePlan& plan, const CacheOptions& cache,
                         const MakeRenderer& make_renderer)
    : source_(replacing(dataset), tree, plan),
      front_(front_options(tree, plan, cache)),
      renderer_(make_renderer(
          {.columns = columns_of(plan), .slots = front_.slots, .slot_points = tree.node_points()})),
      scene_(tree, facts_of(dataset.header()), source_, *renderer_, plan, front_) {}

}  // namespace cairn::viewer
