#include "viewer/front.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

using Clock = std::chrono::steady_clock;

/// How far beyond each edge of the picture nodes are read ahead, as a share of its size.
constexpr double kPrefetchShare = 0.15;

constexpr std::chrono::milliseconds kLongestPause{60'000};

/// What the loader may have ready for one frame.
std::size_t waiting_nodes(unsigned loader_threads) { return loader_threads + 2; }

bool in(const std::vector<NodeIndex>& sorted, NodeIndex node) {
  return std::ranges::binary_search(sorted, node);
}

}  // namespace

std::size_t Front::nodes_under_way(unsigned loader_threads) {
  // With the loader, taken from it, in the cache, and as memory to be written into again.
  return 4 * waiting_nodes(loader_threads);
}

Front::Front(const LodTree& tree, const NodeSource& source, const FrontOptions& options,
             Upload upload)
    : tree_(tree),
      source_(source),
      options_(options),
      upload_(std::move(upload)),
      slots_(options.slots, tree.fanout()),
      cache_(options.cached_nodes + waiting_nodes(options.loader_threads)),
      pause_(options.first_pause),
      loader_(source, options.loader_threads, waiting_nodes(options.loader_threads),
              options.loaded) {
  CAIRN_CHECK(options.uploads >= 1);
}

FrontFrame Front::advance(const View& view, const SelectionLimits& limits, const NodeTest& hidden) {
  FrontFrame frame;
  SelectionLimits held = limits;
  held.nodes = std::min<std::uint64_t>(limits.nodes, slots_.slots());
  uploads_left_ = options_.uploads;
  select_time_ = {};
  if (!slots_.holds(0)) load_root(frame);
  take_loaded(frame);
  if (Clock::now() >= next_attempt_) unreachable_.clear();
  frame.unreachable = unreachable_.size();
  frame.selected = choose(
      view, held, [&](NodeIndex node) { return usable(node); }, hidden);

  const std::vector<NodeIndex>& wanted = frame.selected.nodes;
  const bool held_before =
      std::ranges::all_of(wanted, [&](NodeIndex node) { return slots_.holds(node); });
  // What is in the picture comes first; what is around it only once nothing is missing.
  const std::vector<NodeIndex> around =
      options_.prefetch && held_before ? nodes_around(view, held, frame.selected) : wanted;
  slots_.begin_frame(around);
  for (const NodeIndex node : wanted)
    if (!in(last_, node) && at_hand(node)) ++frame.hits;
  std::vector<NodeIndex> absent;
  bring(around, absent);
  loader_.request(absent);
  frame.missing = static_cast<std::uint64_t>(
      std::ranges::count_if(wanted, [&](NodeIndex node) { return !slots_.holds(node); }));
  const bool goes_on =
      uploads_left_ == 0 || (options_.prefetch && !held_before && frame.missing == 0);
  frame.unfinished = goes_on || !absent.empty();
  frame.waiting = frame.unfinished && !goes_on;
  last_ = wanted;

  frame.drawn =
      frame.missing == 0
          ? frame.selected
          : choose(
                view, held, [&](NodeIndex node) { return slots_.holds(node) && in(wanted, node); },
                hidden);
  frame.select_ms = select_time_.count();
  return frame;
}

Selection Front::choose(const View& view, const SelectionLimits& limits, const NodeTest& usable,
                        const NodeTest& hidden) {
  const auto start = Clock::now();
  Selection selection = select(tree_, view, limits, usable, hidden);
  select_time_ += Clock::now() - start;
  return selection;
}

void Front::load_root(FrontFrame& frame) {
  NodePoints points;
  source_.load(0, points, {});
  CAIRN_CHECK(put_into_slot(0, points));
  ++frame.forced_loads;
  ++frame.loads;
}

void Front::take_loaded(FrontFrame& frame) {
  for (LoadedNode& loaded : loader_.take()) {
    ++frame.loads;
    if (loaded.error == nullptr) {
      pause_ = options_.first_pause;
      if (cache_.contains(loaded.node))
        loader_.recycle(std::move(loaded.points));
      else if (auto gone = cache_.put(loaded.node, std::move(loaded.points)))
        loader_.recycle(std::move(*gone));
      continue;
    }
    try {
      std::rethrow_exception(loaded.error);
    } catch (const formats::Error& error) {
      if (error.kind() == formats::ErrorKind::kInvariant) throw;
      note_failure(loaded.node, error, frame);
    }
  }
}

/// What is damaged stays so; what the network did not bring may come later. A network that fails, or a dataset that was changed
/// behind it, fails for many nodes at a time: one of them is told.
void Front::note_failure(NodeIndex node, const formats::Error& error, FrontFrame& frame) {
  const bool later = source_.is_remote() && error.kind() == formats::ErrorKind::kSystem;
  const bool is_new = later ? unreachable_.insert(node).second : damaged_.insert(node).second;
  if (later && Clock::now() >= next_attempt_) {
    next_attempt_ = Clock::now() + pause_;
    pause_ = std::min(2 * pause_, kLongestPause);
  }
  if (is_new && (!source_.is_remote() || told_.insert(error.parts().what).second))
    frame.damage.emplace_back(error.what());
}

std::vector<NodeIndex> Front::nodes_around(const View& view, const SelectionLimits& limits,
                                           const Selection& selected) {
  SelectionLimits wider = limits;
  const double area = (1 + 2 * kPrefetchShare) * (1 + 2 * kPrefetchShare);
  if (limits.points != SelectionLimits::kUnlimited)
    wider.points = static_cast<std::uint64_t>(static_cast<double>(limits.points) * area);
  const Selection around =
      choose(view.widened(kPrefetchShare), wider, [&](NodeIndex node) { return usable(node); }, {});
  std::vector<NodeIndex> nodes;
  std::ranges::set_union(selected.nodes, around.nodes, std::back_inserter(nodes));
  return nodes.size() <= slots_.slots() ? nodes : selected.nodes;
}

/// Puts nodes that are decoded into slots, parents first, and lists those that must be read.
void Front::bring(std::span<const NodeIndex> nodes, std::vector<NodeIndex>& absent) {
  for (const NodeIndex node : nodes) {
    if (slots_.holds(node)) continue;
    if (const NodePoints* points = cache_.find(node))
      put_into_slot(node, *points);
    else
      absent.push_back(node);
  }
}

bool Front::put_into_slot(NodeIndex node, const NodePoints& points) {
  if (uploads_left_ == 0 || !slots_.accepts(node)) return false;
  const auto slot = slots_.insert(node);
  if (!slot) return false;
  --uploads_left_;
  upload_(*slot, points.columns());
  return true;
}

}  // namespace cairn::viewer
