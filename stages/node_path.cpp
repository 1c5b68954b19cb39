#include "stages/node_path.h"

#include <algorithm>
#include <utility>

#include "formats/dataset/node_frame.h"

namespace cairn::stages {

using formats::Level;
using formats::NodeId;

Level level_of_subtrees(const formats::Tree& tree) {
  constexpr std::uint64_t kSubtrees = 64;
  Level level = 0;
  while (level < tree.leaf_level() && tree.nodes_on(level) < kSubtrees) ++level;
  return level;
}

std::vector<NodeId> nodes_down_to(const formats::Tree& tree, NodeId node) {
  std::vector<NodeId> nodes{node};
  while (formats::value_of(nodes.back()) != 0) nodes.push_back(tree.parent(nodes.back()));
  std::ranges::reverse(nodes);
  return nodes;
}

std::vector<NodeId> nodes_of_walk(const formats::Tree& tree, NodeId node) {
  std::vector<NodeId> nodes = nodes_down_to(tree, node);
  std::vector<NodeId> open;  // the next one last
  const auto add_children = [&](NodeId parent) {
    if (tree.is_leaf(parent)) return;
    for (std::uint64_t i = tree.fanout(); i-- > 0;)
      open.push_back(NodeId{formats::value_of(tree.first_child(parent)) + i});
  };
  add_children(node);
  while (!open.empty()) {
    nodes.push_back(open.back());
    open.pop_back();
    add_children(nodes.back());
  }
  return nodes;
}

double displacement_of(const formats::DatasetReader& dataset, NodeId id) {
  const bool leaf = dataset.tree().is_leaf(id);
  return formats::NodeFrame::of(dataset.header(), leaf, dataset.record(id))
      .displacement_bound(dataset.header().grid);
}

NodePath::NodePath(const formats::DatasetReader& dataset, const formats::SectionSet& wanted,
                   std::vector<NodeId> walk)
    : dataset_(dataset),
      wanted_(formats::SectionSet(wanted).set(formats::kRepresentativeSection)),
      ahead_(dataset, wanted_, std::move(walk)),
      steps_(dataset.tree().leaf_level() + 1) {}

void NodePath::enter(Level level, NodeId id) {
  Step& step = steps_[level];
  step.id = id;
  ahead_.next();
  step.points = dataset_.read_node(id, wanted_);
  step.stands_for.assign(level, {});
  if (level == 0) return;
  step.stands_for[level - 1] = step.points.representative;
  for (Level k = 0; k + 1 < level; ++k) {
    step.stands_for[k].reserve(step.points.count());
    for (const std::uint32_t r : step.points.representative)
      step.stands_for[k].push_back(steps_[level - 1].stands_for[k][r]);
  }
}

}  // namespace cairn::stages
