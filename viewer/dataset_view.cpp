#include "viewer/dataset_view.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

FrontOptions front_options(const LodTree& tree, const FramePlan& plan, const CacheOptions& cache) {
  const std::uint64_t node_bytes = tree.node_points() * columns_of(plan).point_bytes();
  const std::uint64_t share = cache.beside_renderer ? cache.bytes / 2 : cache.bytes;
  // Renderers number points by 31 bits.
  const std::uint64_t most = std::min<std::uint64_t>(tree.size(), INT32_MAX / tree.node_points());
  const std::uint64_t slots = std::min<std::uint64_t>(share / node_bytes, most);
  if (slots == 0)
    formats::throw_usage(
        fmt::format("a cache of {} bytes holds no node; one of this dataset takes {} bytes", share,
                    node_bytes));
  return {.slots = static_cast<std::uint32_t>(slots),
          .cached_nodes = cache.beside_renderer ? static_cast<std::size_t>(slots) : 1,
          .loader_threads = cache.loader_threads,
          .prefetch = cache.prefetch,
          .uploads = cache.uploads};
}

/// In a dataset whose children add to their parents, a block would have to stay drawn beside its child.
const formats::DatasetReader& replacing(const formats::DatasetReader& dataset) {
  if (dataset.header().refinement != formats::Refinement::kReplace)
    formats::throw_input({.what = "a dataset whose nodes add to their parents cannot be drawn"});
  return dataset;
}

}  // namespace

DatasetView::DatasetView(const formats::DatasetReader& dataset, const LodTree& tree,
                         const FramePlan& plan, const CacheOptions& cache,
                         const MakeRenderer& make_renderer)
    : source_(replacing(dataset), tree, plan),
      front_(front_options(tree, plan, cache)),
      renderer_(make_renderer(
          {.columns = columns_of(plan), .slots = front_.slots, .slot_points = tree.node_points()})),
      scene_(tree, facts_of(dataset.header()), source_, *renderer_, plan, front_) {}

}  // namespace cairn::viewer
