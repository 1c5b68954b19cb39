#include "stages/verify/subtree_walk.h"

#include <algorithm>
#include <cmath>

#include "stages/node_path.h"
#include "stages/parallel.h"
#include "stages/verify/node_checks.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeData;
using formats::NodeId;
using formats::NodeRecord;

/// For what is summed in doubles over many points, and for bounds that were rounded.
constexpr double kSlack = 1e-9;

class Walk {
 public:
  Walk(const Context& context, const DatasetReader& dataset, NodeId top)
      : context_(context),
        dataset_(dataset),
        top_level_(dataset.tree().level_of(top)),
        path_(dataset, formats::all_sections(), nodes_of_walk(dataset.tree(), top)),
        sums_(dataset.tree().leaf_level() + 1) {}

  /// Goes down from the root to `top`, then through all below it.
  SubtreeResult run(NodeId top) {
    const std::vector<NodeId> down = nodes_down_to(dataset_.tree(), top);
    const std::uint64_t index = dataset_.tree().index_on_level(top);
    for (Level level = 0; level < top_level_; ++level) {
      // The subtree with the first leaves of a common ancestor checks the ancestor too.
      const bool first = index % dataset_.tree().nodes_on(top_level_ - level) == 0;
      enter(level, down[level], first);
    }
    visit(top_level_, top);
    for (Level level = 0; level < top_level_; ++level) result_.above.push_back(sums_[level]);
    return std::move(result_);
  }

 private:
  void enter(Level level, NodeId id, bool check) {
    throw_if_stopped(context_);
    path_.enter(level, id);
    sums_[level] = {};
    if (!check) return;
    const NodeData& points = path_.points(level);
    result_.digested_leaves += check_node(dataset_, id, points, result_.findings);
    if (level > 0)
      check_against_parent(dataset_, id, points, path_.points(level - 1), result_.findings);
    result_.points += points.count();
    if (context_.progress != nullptr) context_.progress->advance(points.count());
  }

  void visit(Level level, NodeId id) {
    enter(level, id, true);
    if (level == dataset_.tree().leaf_level()) {
      ++result_.leaves;
      const double moved = displacement_of(dataset_, id);
      for (Level k = 0; k < level; ++k) measure(level, k, moved);
      return;
    }
    const std::uint64_t first = formats::value_of(dataset_.tree().first_child(id));
    for (std::uint64_t i = 0; i < dataset_.tree().fanout(); ++i)
      visit(level + 1, NodeId{first + i});
    check_rms(dataset_, id, sums_[level], result_.findings);
  }

  /// Compares the points of the leaf at the end of the path with those that stand for them on level k.
  void measure(Level leaf_level, Level k, double moved) {
    const std::vector<formats::GridPoint>& leaf = path_.points(leaf_level).position;
    const std::vector<formats::GridPoint>& above = path_.points(k).position;
    const std::vector<std::uint32_t>& stands_for = path_.stands_for(leaf_level, k);
    double largest = 0;
    ErrorSum sum{.largest_leaf_moved = moved};
    for (std::size_t i = 0; i < leaf.size(); ++i) {
      const double d2 =
          formats::squared_distance(dataset_.header().grid, leaf[i], above[stands_for[i]]);
      largest = std::max(largest, d2);
      sum.squares += d2;
    }
    sums_[k].add(sum);
    const double found = std::sqrt(largest);
    const double expected = dataset_.record(path_.id(k)).bound + moved;
    result_.findings.check(Invariant::kError, found <= expected * (1 + kSlack), path_.id(k),
                           "distance of a leaf point from its representative against the bound",
                           found, expected, leaf.size());
  }

  const Context& context_;
  const DatasetReader& dataset_;
  const Level top_level_;
  NodePath path_;
  std::vector<ErrorSum> sums_;  ///< of the path's nodes, by level
  SubtreeResult result_;
};

}  // namespace

void ErrorSum::add(const ErrorSum& other) {
  squares += other.squares;
  largest_leaf_moved = std::max(largest_leaf_moved, other.largest_leaf_moved);
}

void check_rms(const DatasetReader& dataset, NodeId node, const ErrorSum& sum, Findings& findings) {
  const NodeRecord& record = dataset.record(node);
  const double measured = std::sqrt(sum.squares / static_cast<double>(record.weight));
  const double slack =
      (sum.largest_leaf_moved + displacement_of(dataset, node)) * (1 + kSlack) + kSlack * measured;
  findings.check(Invariant::kError, std::abs(measured - record.rms) <= slack, node,
                 "RMS error measured against recorded", measured, record.rms);
}

SubtreeResult walk_subtree(const Context& context, const DatasetReader& dataset, NodeId top) {
  return Walk(context, dataset, top).run(top);
}

}  // namespace cairn::stages
