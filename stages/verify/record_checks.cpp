#include "stages/verify/record_checks.h"

#include <algorithm>
#include <cmath>

#include "formats/dataset/metadata.h"
#include "formats/dataset/node_frame.h"
#include "formats/wide_int.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeId;
using formats::NodeRecord;
using formats::Tree;

/// A 128-bit sum as 64 bits, saturated: what does not fit is wrong in any case.
std::uint64_t narrowed(formats::Uint128 sum) {
  return sum > UINT64_MAX ? UINT64_MAX : static_cast<std::uint64_t>(sum);
}

void check_header(const DatasetReader& dataset, Findings& findings) {
  const formats::DatasetHeader& header = dataset.header();
  const formats::Uint128 told = formats::Uint128{header.dropped_points} + header.points;
  findings.equal(Invariant::kConservation, NodeId{0}, "points read = dropped + kept",
                 header.read_points, narrowed(told));
  if (const auto error = formats::check_metadata(dataset.metadata(), header))
    findings.check(Invariant::kConservation, false, NodeId{0}, error->what.c_str(), error->found,
                   error->expected);
}

void check_levels(const DatasetReader& dataset, Findings& findings) {
  const Tree& tree = dataset.tree();
  for (Level level = 0; level <= tree.leaf_level(); ++level) {
    formats::Uint128 weight = 0, points = 0;
    for (std::uint64_t i = 0; i < tree.nodes_on(level); ++i) {
      const NodeRecord& record = dataset.record(tree.id(level, i));
      weight += record.weight;
      points += record.point_count;
    }
    const NodeId first = tree.id(level, 0);
    findings.equal(Invariant::kConservation, first, "sum of weights on a level", narrowed(weight),
                   tree.points());
    if (level == tree.leaf_level())
      findings.equal(Invariant::kConservation, first, "sum of leaf counts", narrowed(points),
                     tree.points());
  }
}

void check_leaf_sizes(const DatasetReader& dataset, Findings& findings) {
  const Tree& tree = dataset.tree();
  std::uint64_t least = UINT64_MAX, most = 0;
  for (std::uint64_t i = 0; i < tree.nodes_on(tree.leaf_level()); ++i) {
    const std::uint64_t count = dataset.record(tree.id(tree.leaf_level(), i)).point_count;
    least = std::min(least, count);
    most = std::max(most, count);
  }
  findings.check(Invariant::kUniformity, most - least <= 1, tree.id(tree.leaf_level(), 0),
                 "difference between the largest and the smallest leaf", most - least,
                 std::string("at most 1"));
}

void check_leaf(const DatasetReader& dataset, const NodeRecord& record, Findings& findings) {
  findings.equal<std::uint64_t>(Invariant::kConservation, record.id, "weight of a leaf",
                                record.weight, record.point_count);
  findings.check(Invariant::kCoverage, record.cover_factor == 1.0f, record.id,
                 "cover factor of a leaf", static_cast<double>(record.cover_factor), 1.0);
  const double moved = formats::NodeFrame::of(dataset.header(), true, record)
                           .displacement_bound(dataset.header().grid);
  findings.check(Invariant::kError, record.bound >= moved, record.id,
                 "error bound of a leaf against its quantisation", record.bound, moved);
  findings.check(Invariant::kError, record.rms == 0, record.id, "RMS error of a leaf", record.rms,
                 0.0);
}

/// A node's box is that of its points and of its children, no larger.
void check_box(const DatasetReader& dataset, const NodeRecord& record, Findings& findings) {
  formats::GridBox box = record.position_box;
  if (!dataset.tree().is_leaf(record.id)) {
    const std::uint64_t first = formats::value_of(dataset.tree().first_child(record.id));
    for (std::uint32_t i = 0; i < dataset.tree().fanout(); ++i)
      box.add(dataset.record(NodeId{first + i}).box);
  }
  findings.check(Invariant::kContainment, box == record.box, record.id,
                 "box against that of the node's points and children",
                 shown(record.box.min) + " to " + shown(record.box.max),
                 shown(box.min) + " to " + shown(box.max));
}

/// Splats without extent cover nothing at any factor, which the record says by an infinite one.
void count_uncovered(const DatasetReader& dataset, Findings& findings) {
  const auto uncovered = std::ranges::count_if(
      dataset.nodes(), [](const NodeRecord& record) { return std::isinf(record.cover_factor); });
  if (uncovered > 0)
    findings.leave_unchecked(Invariant::kCoverage, std::to_string(uncovered) + " of " +
                                                       std::to_string(dataset.nodes().size()) +
                                                       " nodes, which have splats without extent");
}

void check_inner(const DatasetReader& dataset, const NodeRecord& record, Findings& findings) {
  const Tree& tree = dataset.tree();
  findings.equal<std::uint64_t>(Invariant::kUniformity, record.id, "points of an inner node",
                                record.point_count, tree.node_points());
  formats::Uint128 weight = 0;
  formats::Digest digest;
  const std::uint64_t first = formats::value_of(tree.first_child(record.id));
  for (std::uint32_t i = 0; i < tree.fanout(); ++i) {
    const NodeRecord& child = dataset.record(NodeId{first + i});
    weight += child.weight;
    digest += child.digest;
    findings.equal<std::uint64_t>(
        Invariant::kUniformity, child.id, "points that stand for a child in its parent",
        record.block_start[i + 1] - record.block_start[i], tree.quota(child.id));
  }
  findings.equal(Invariant::kConservation, record.id, "weight against the sum of the children's",
                 record.weight, narrowed(weight));
  findings.equal(Invariant::kConservation, record.id, "digest against the sum of the children's",
                 record.digest, digest);
}

}  // namespace

Findings check_records(const DatasetReader& dataset) {
  Findings findings;
  check_header(dataset, findings);
  check_levels(dataset, findings);
  check_leaf_sizes(dataset, findings);
  count_uncovered(dataset, findings);
  for (const NodeRecord& record : dataset.nodes()) {
    findings.check(Invariant::kError, record.rms <= record.bound * (1 + 1e-9), record.id,
                   "RMS error against the bound", record.rms, record.bound);
    check_box(dataset, record, findings);
    if (dataset.tree().is_leaf(record.id))
      check_leaf(dataset, record, findings);
    else
      check_inner(dataset, record, findings);
  }
  return findings;
}

}  // namespace cairn::stages
