#include "stages/verify/verify.h"

#include <algorithm>
#include <mutex>

#include "formats/dataset/digest.h"
#include "formats/dataset/effect_metadata.h"
#include "formats/error.h"
#include "stages/node_path.h"
#include "stages/parallel.h"
#include "stages/verify/record_checks.h"
#include "stages/verify/subtree_walk.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeId;
using formats::Tree;

/// Adds the sums of the subtrees up for every node above them, in the order of the subtrees.
void check_top(const DatasetReader& dataset, Level top_level,
               const std::vector<SubtreeResult>& subtrees, Findings& findings) {
  const Tree& tree = dataset.tree();
  for (Level level = 0; level < top_level; ++level) {
    const std::uint64_t share = tree.nodes_on(top_level - level);
    for (std::uint64_t i = 0; i < tree.nodes_on(level); ++i) {
      ErrorSum sum;
      for (std::uint64_t k = i * share; k < (i + 1) * share; ++k) sum.add(subtrees[k].above[level]);
      check_rms(dataset, tree.id(level, i), sum, findings);
    }
  }
}

void check_points(const Context& context, const DatasetReader& dataset, VerifyReport& report,
                  Findings& findings) {
  const Tree& tree = dataset.tree();
  const Level top_level = level_of_subtrees(tree);
  std::vector<SubtreeResult> subtrees(tree.nodes_on(top_level));
  run_in_arena(context.threads, [&] {
    for_each_piece(subtrees.size(), [&](std::uint64_t i) {
      subtrees[i] = walk_subtree(context, dataset, tree.id(top_level, i));
    });
  });
  check_top(dataset, top_level, subtrees, findings);
  std::uint64_t leaves = 0;
  for (SubtreeResult& subtree : subtrees) {
    findings.append(std::move(subtree.findings));
    report.points += subtree.points;
    report.digested_leaves += subtree.digested_leaves;
    leaves += subtree.leaves;
  }
  if (report.digested_leaves == leaves) return;
  const std::string lossy = std::to_string(leaves - report.digested_leaves) + " of " +
                            std::to_string(leaves) +
                            " leaves, whose points are not stored without loss";
  findings.leave_unchecked(Invariant::kConservation, "the digests of " + lossy);
  findings.leave_unchecked(Invariant::kError,
                           "the distance from their inputs of the points of " + lossy);
}

void check_sources(const Context& context, const DatasetReader& dataset,
                   const std::optional<RecordSource>& sources, Findings& findings) {
  if (!sources)
    return findings.leave_unchecked(Invariant::kConservation,
                                    "the points of the sources, which were not given");
  formats::Digest digest;
  std::uint64_t points = 0;
  std::mutex mutex;
  (*sources)([&](std::span<const std::byte> records, std::size_t stride) {
    throw_if_stopped(context);
    const formats::Digest part = formats::digest_of(records, stride);
    const std::lock_guard lock(mutex);
    digest += part;
    points += records.size() / stride;
  });
  formats::ToldEffects removed;  // where the metadata is broken, check_records tells
  if (formats::read_metadata_effects(dataset.metadata(), removed)) removed = {};
  formats::Digest expected = dataset.record(NodeId{0}).digest;
  expected += removed.digest;
  findings.equal(Invariant::kConservation, NodeId{0}, "points of the sources", points,
                 dataset.header().points + removed.removed);
  findings.equal(Invariant::kConservation, NodeId{0}, "digest of the sources' points", digest,
                 expected);
}

}  // namespace

std::string_view name_of(Invariant invariant) {
  switch (invariant) {
    case Invariant::kConservation:
      return "conservation";
    case Invariant::kUniformity:
      return "uniformity";
    case Invariant::kContainment:
      return "containment";
    case Invariant::kError:
      return "error";
    case Invariant::kCoverage:
      return "coverage";
  }
  return "unknown";
}

bool VerifyReport::held() const {
  return std::ranges::all_of(invariants, [](const InvariantReport& r) { return r.held(); });
}

VerifyReport verify_dataset(const Context& context, const DatasetReader& dataset,
                            const std::optional<RecordSource>& sources) {
  if (dataset.header().refinement != formats::Refinement::kReplace)
    formats::throw_input({.what = "a dataset whose children add to their parent cannot be verified",
                          .found = "refinement add",
                          .expected = "refinement replace"});
  std::uint64_t stored = 0;
  for (const formats::NodeRecord& record : dataset.nodes()) stored += record.point_count;
  if (context.progress != nullptr) context.progress->begin("verify", stored);
  VerifyReport report;
  report.nodes = dataset.nodes().size();
  report.bytes =
      dataset.index_size_bytes() + dataset.head().nodes_size_bytes + dataset.metadata().size();
  Findings findings = check_records(dataset);
  check_points(context, dataset, report, findings);
  check_sources(context, dataset, sources, findings);
  report.invariants = std::move(findings).take();
  if (context.progress != nullptr) context.progress->end();
  return report;
}

}  // namespace cairn::stages
