#include "stages/measure/level_search.h"

#include <functional>

namespace cairn::stages {

using formats::GridPoint;
using formats::Level;
using formats::NodeId;

SearchedLevel::SearchedLevel(const formats::DatasetReader& dataset, Level level) : level_(level) {
  const formats::Tree& tree = dataset.tree();
  widest_.resize(formats::value_of(tree.id(level, 0)) + tree.nodes_on(level));
  for (std::uint64_t id = widest_.size(); id-- > 0;) {
    if (tree.level_of(NodeId{id}) == level) widest_[id] = dataset.record(NodeId{id}).radius_max;
    if (id == 0) continue;
    float& above = widest_[formats::value_of(tree.parent(NodeId{id}))];
    above = std::max(above, widest_[id]);
  }
}

void LevelSearch::push(Level level, NodeId id, const GridPoint& query, const SplatSink& sink) {
  const double box = squared_distance(dataset_.header().grid.step, query, dataset_.record(id).box);
  const double rank = sink.rank(box, level_.widest_below(id));
  if (!sink.wants(rank)) return;
  waiting_.push_back({rank, level, id});
  std::ranges::push_heap(waiting_, std::greater{});
}

void LevelSearch::search(const GridPoint& query, SplatSink& sink) {
  const formats::Tree& tree = dataset_.tree();
  waiting_.clear();
  push(0, NodeId{0}, query, sink);
  while (!waiting_.empty()) {
    std::ranges::pop_heap(waiting_, std::greater{});
    const Waiting next = waiting_.back();
    waiting_.pop_back();
    if (!sink.wants(next.rank)) return;  // those that wait rank no better
    if (next.level == level_.level()) {
      search_node(next.id, query, sink);
      continue;
    }
    const std::uint64_t first = formats::value_of(tree.first_child(next.id));
    for (std::uint64_t i = 0; i < tree.fanout(); ++i)
      push(next.level + 1, NodeId{first + i}, query, sink);
  }
}

void LevelSearch::search_node(NodeId id, const GridPoint& query, SplatSink& sink) {
  if (last_ == nullptr || last_id_ != id) {
    last_ = cache_.get(id);
    last_id_ = id;
  }
  for (const SplatNode::RadiusClass& splats : last_->classes()) {
    sink.begin(splats);
    splats.index->search(query, sink);
  }
}

}  // namespace cairn::stages
