#include "stages/cluster/cluster.h"

#include <algorithm>
#include <numeric>

#include "formats/dataset/node_frame.h"
#include "formats/error.h"
#include "stages/cluster/aggregate.h"
#include "stages/cluster/leaf_loader.h"
#include "stages/cluster/share_state.h"
#include "stages/cluster/splat_radius.h"
#include "stages/parallel.h"

namespace cairn::stages {

using formats::IndexRange;
using formats::Level;
using formats::NodeId;
using formats::Tree;

namespace {

/// `blocks`: how many, about as long as each other, will be appended.
template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from, std::size_t blocks) {
  if (to.empty()) to.reserve((from.size() + 1) * blocks);
  to.insert(to.end(), from.begin(), from.end());
}

/// Of the grids of two blocks, 0 where one needed none.
std::uint32_t coarser_grid(std::uint32_t a, std::uint32_t b) {
  return a == 0 || b == 0 ? std::max(a, b) : std::min(a, b);
}

/// The children's representatives, one block after the other, as the points of their parent.
void append_block(WorkingNode& node, const WorkingNode& block, std::size_t blocks) {
  append(node.data.position, block.data.position, blocks);
  append(node.data.weight, block.data.weight, blocks);
  append(node.data.radius, block.data.radius, blocks);
  append(node.normal, block.normal, blocks);
  append(node.residual, block.residual, blocks);
  append(node.bound, block.bound, blocks);
  append(node.reach, block.reach, blocks);
  append(node.normal_sum, block.normal_sum, blocks);
  node.data.attributes.resize(block.data.attributes.size());
  node.mean_sum.resize(block.mean_sum.size());
  for (std::size_t a = 0; a < block.data.attributes.size(); ++a) {
    append(node.data.attributes[a], block.data.attributes[a], blocks);
    append(node.mean_sum[a], block.mean_sum[a], blocks);
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    node.squared_steps[axis] += block.squared_steps[axis];
  node.box.add(block.box);
  node.weight += block.weight;
  node.digest += block.digest;
  node.theta = std::max(node.theta, block.theta);
  node.grid = coarser_grid(node.grid, block.grid);
  node.numerics.add(block.numerics);
}

/// The units are the subtrees below the nodes of one level. What a subtree hands to the level above is kept with its unit:
/// on a level where that is little beside the points, and where there are not too many.
constexpr std::string_view kUnits = unit_log::kCluster;
constexpr std::uint64_t kMostUnits = 1024;

Level unit_level(const Tree& tree) {
  const Level leaf = tree.leaf_level();
  Level level = leaf > 2 ? leaf - 2 : leaf > 0 ? leaf - 1 : 0;
  while (level > 0 && tree.nodes_on(level) > kMostUnits) --level;
  return level;
}

/// The points in the order of their groups, in each as in `order`: a counting sort.
std::vector<std::uint32_t> order_by_group(const std::vector<std::uint32_t>& order,
                                          const std::vector<std::uint32_t>& group_of) {
  std::vector<std::uint32_t> next(*std::ranges::max_element(group_of) + 2);
  for (const std::uint32_t group : group_of) ++next[group + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<std::uint32_t> sorted(order.size());
  for (const std::uint32_t point : order) sorted[next[group_of[point]]++] = point;
  return sorted;
}

class TreeClusterer {
 public:
  TreeClusterer(const ClusterInput& input, NodeSink& sink, Context& context)
      : in_(input),
        tree_(input.header.tree()),
        unit_level_(unit_level(tree_)),
        sink_(sink),
        context_(context) {}

  /// Finishes the subtree below a node, hands all its nodes on, and returns the node's share of its
  /// parent (nothing for the root).
  WorkingNode visit(Level level, std::uint64_t index) {
    throw_if_stopped(context_);
    return level == unit_level_ ? visit_unit(level, index) : finish_subtree(level, index);
  }

 private:
  /// As visit, unless an earlier run has done it.
  WorkingNode visit_unit(Level level, std::uint64_t index) {
    const NodeId id = tree_.id(level, index);
    if (const auto known = finished_unit(context_, kUnits, value_of(id))) {
      StateReader state(*known);
      WorkingNode share = get_share(state);
      if (sink_.restore(id, state)) {
        context_.progress->advance(tree_.input_range(level, index).count);
        return share;
      }
    }
    WorkingNode share = finish_subtree(level, index);
    if (context_.units == nullptr) return share;
    StateWriter state;
    put_share(state, share);
    sink_.save(id, state);
    context_.units->finish(kUnits, value_of(id), state.bytes());
    return share;
  }

  WorkingNode finish_subtree(Level level, std::uint64_t index) {
    const NodeId id = tree_.id(level, index);
    const bool leaf = level == tree_.leaf_level();
    WorkingNode node = leaf ? load_leaf(in_.header, records_of(index)) : gather(level, index);
    if (value_of(id) == 0) {
      if (leaf) follow_curve(node);
      hand_on(id, std::move(node), {});
      return {};
    }
    const CurveOrder curve = order_along_curve(in_.header.grid, node.data.position, in_.grid);
    if (node.data.radius.empty())
      node.data.radius = radii_from_density(in_.header.grid, node.data.position, curve);
    const std::uint64_t quota = tree_.quota(id);
    Reduction reduction =
        in_.reducer.reduce({id, in_.header.grid, node.data.position, node.data.weight, node.normal,
                            node.data.radius, curve},
                           quota);
    if (leaf) group_by_representative(node, index, curve, reduction);
    const auto frame = formats::NodeFrame::fit(in_.header, leaf, node.data);
    const std::vector<float> decoded_radius = frame.quantized_radii(node.data.radius);
    WorkingNode share = aggregate({node, reduction, quota, in_.header.grid, in_.header.schema,
                                   decoded_radius, frame.displacement_bound(in_.header.grid)});
    share.box = node.box;
    share.weight = node.weight;
    share.digest = node.digest;
    hand_on(id, std::move(node), std::move(reduction.representative));
    return share;
  }

  LeafRecords records_of(std::uint64_t index) const {
    const IndexRange range = tree_.input_range(tree_.leaf_level(), index);
    if (in_.records.size_bytes() == 0) throw WorkLost{};  // all had been clustered, it was told
    return {in_.records.bytes().subspan(range.first * in_.stride, range.count * in_.stride),
            in_.stride};
  }

  /// Brings a leaf into its order for good; its records are done with.
  void reorder(WorkingNode& leaf, std::uint64_t index, std::span<const std::uint32_t> order) {
    reorder_leaf(leaf, in_.header, records_of(index), order);
    const IndexRange range = tree_.input_range(tree_.leaf_level(), index);
    in_.records.release(range.first * in_.stride, range.count * in_.stride);
    context_.progress->advance(range.count);
  }

  WorkingNode gather(Level level, std::uint64_t index) {
    std::vector<WorkingNode> shares(tree_.fanout());
    for_each_piece(tree_.fanout(), [&](std::uint64_t i) {
      shares[i] = visit(level + 1, index * tree_.fanout() + i);
    });
    WorkingNode node;
    for (WorkingNode& share : shares) {
      append_block(node, share, shares.size());
      share = {};
    }
    return node;
  }

  /// Brings a leaf that is the whole tree into curve order.
  void follow_curve(WorkingNode& leaf) {
    const CurveOrder curve = order_along_curve(in_.header.grid, leaf.data.position, in_.grid);
    if (leaf.data.radius.empty())
      leaf.data.radius = radii_from_density(in_.header.grid, leaf.data.position, curve);
    reorder(leaf, 0, curve.order);
  }

  /// Stores a leaf's points in the order of their representatives, along the curve within each.
  void group_by_representative(WorkingNode& leaf, std::uint64_t index, const CurveOrder& curve,
                               Reduction& reduction) {
    const std::vector<std::uint32_t> order = order_by_group(curve.order, reduction.representative);
    reorder(leaf, index, order);
    std::vector<std::uint32_t> moved(order.size()), place(order.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      moved[i] = reduction.representative[order[i]];
      place[order[i]] = i;
    }
    reduction.representative = std::move(moved);
    for (std::uint32_t& chosen : reduction.chosen) chosen = place[chosen];
    for (auto& shares : reduction.blend)
      for (Share& share : shares) share.point = place[share.point];
  }

  std::vector<std::uint32_t> block_starts(NodeId id, std::size_t count) const {
    std::vector<std::uint32_t> starts(tree_.fanout() + 1, static_cast<std::uint32_t>(count));
    starts[0] = 0;
    if (tree_.is_leaf(id)) return starts;
    for (std::uint32_t i = 0; i < tree_.fanout(); ++i) {
      const NodeId child{value_of(tree_.first_child(id)) + i};
      starts[i] = static_cast<std::uint32_t>(tree_.quota_start(child));
    }
    return starts;
  }

  void hand_on(NodeId id, WorkingNode&& node, std::vector<std::uint32_t> representative) {
    const auto offset = value_of(id) == 0 ? 0 : static_cast<std::uint32_t>(tree_.quota_start(id));
    for (std::uint32_t& r : representative) r += offset;
    ClusteredNode clustered;
    clustered.id = id;
    clustered.block_start = block_starts(id, node.count());
    clustered.points = std::move(node.data);
    clustered.points.representative = std::move(representative);
    clustered.subtree_box = node.box;
    clustered.weight = node.weight;
    for (std::size_t axis = 0; axis < 3; ++axis)
      clustered.squared_error += in_.header.grid.step[axis] * in_.header.grid.step[axis] *
                                 static_cast<double>(node.squared_steps[axis]);
    clustered.bound =
        node.bound.empty() ? 0 : *std::max_element(node.bound.begin(), node.bound.end());
    clustered.reach = std::move(node.reach);
    clustered.theta = node.theta;
    clustered.grid = node.grid;
    clustered.digest = node.digest;
    clustered.numerics = node.numerics;
    sink_.take(std::move(clustered));
  }

  const ClusterInput& in_;
  const Tree tree_;
  const Level unit_level_;
  NodeSink& sink_;
  Context& context_;
};

}  // namespace

std::uint64_t cluster_worker_bytes(const Tree& tree, std::size_t stride) {
  const std::uint64_t node_bytes = tree.node_points() * (2 * stride + 220);
  const std::uint64_t share_bytes = tree.node_points() * (stride + 110);
  // A unit's share stands there once more as bytes for the log, twice a fraction of what a node holds.
  return node_bytes + share_bytes * (std::max<Level>(1, tree.leaf_level()) + 1);
}

void cluster(const ClusterInput& input, NodeSink& sink, Context& context) {
  // Blocks have fixed sizes, see Tree::quota.
  CAIRN_CHECK(input.reducer.exact_count());
  context.progress->begin("cluster", input.header.points);
  // Each worker holds a path of the tree; where memory is short fewer work at a time.
  const std::uint64_t worker_bytes = cluster_worker_bytes(input.header.tree(), input.stride);
  run_in_arena(workers_within(context, worker_bytes),
               [&] { TreeClusterer(input, sink, context).visit(0, 0); });
  finish_unit(context, kUnits, kStageDone, {});
  context.progress->end();
}

}  // namespace cairn::stages
