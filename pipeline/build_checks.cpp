#include "pipeline/build_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "formats/dataset/grid.h"
#include "formats/error.h"
#include "pipeline/failure.h"
#include "pipeline/human.h"
#include "pipeline/memory_budget.h"
#include "pipeline/stage_options.h"
#include "stages/cluster/cluster.h"

namespace cairn::pipeline {
namespace {

constexpr std::uint64_t kProgramBytes = std::uint64_t{16} << 20;

/// The most bytes that work arrays take at a time, of the stages that an earlier build has left undone.
std::uint64_t array_bytes(const Journal& journal, const BuildOptions& options,
                          const stages::CampaignSize& size, std::uint64_t final_records) {
  const std::uint64_t records = size.points * size.record_bytes;
  if (journal.is_done(stages::unit_log::kCluster)) return 0;
  if (estimates(options) && journal.is_done(stages::unit_log::kEstimate)) return final_records;
  const std::uint64_t after_split = estimates(options) ? records + final_records : records;
  if (journal.is_done(stages::unit_log::kSplit)) return after_split;
  const std::uint64_t splitting = std::max(2 * records, after_split);
  if (!options.filter.any()) return std::max(size.import_bytes + records, splitting);
  if (journal.is_done(stages::unit_log::kFilter)) return splitting;
  return std::max(size.import_bytes + records,
                  2 * records + size.points * stages::kFilterBytesAPoint);
}

}  // namespace

void require_room_for_estimates(const BuildOptions& options, const formats::Schema& schema) {
  for (const formats::Attribute& attribute : schema) {
    const bool normal = attribute.rule == formats::ReduceRule::kNormal ||
                        attribute.name == formats::attribute_name::kNormal;
    const bool radius = attribute.name == formats::attribute_name::kRadius;
    if ((options.estimate_normals && normal) || (options.estimate_radii && radius))
      formats::throw_usage(
          fmt::format("estimate: the scans bring {0} themselves; to have them estimated anew, "
                      "leave theirs out with --drop {1}",
                      normal ? "normals" : "radii", attribute.name));
  }
}

void require_disk(const Workspace& workspace, const Journal& journal, const BuildOptions& options,
                  const stages::CampaignSize& size, bool numbered) {
  const std::uint64_t final_records =
      size.points *
      stages::estimated_stride(size.record_bytes, numbered, estimate_options(options));
  const std::uint64_t packed = final_records + final_records / 2 + (std::uint64_t{1} << 20);
  workspace.require_free(array_bytes(journal, options, size, final_records) + packed, packed);
}

void require_node_memory(const formats::Tree& tree, std::size_t stride,
                         std::uint64_t memory_bytes) {
  require_memory(fmt::format("a node of {} points", tree.node_points()),
                 stages::cluster_worker_bytes(tree, stride) + kProgramBytes, memory_bytes,
                 "lower node_points or raise");
}

void tell_lost_detail(const stages::Scans& scans, const stages::ImportedPoints& imported) {
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const stages::ScanLedger& ledger = imported.ledger[s];
    if (scans[s]->info().encoding == formats::PositionEncoding::kSteps || ledger.box.empty())
      continue;
    double longest = 0;
    for (int axis = 0; axis < 3; ++axis)
      longest = std::max(
          longest, imported.grid.step[static_cast<std::size_t>(axis)] * ledger.box.span(axis));
    if (longest == 0 || longest >= 65536 * ledger.precision) continue;
    tell_note(fmt::format(
        "the coordinates of {} are {} numbers that stand {} apart there, in {} "
        "from end to end: finer detail was lost before",
        printable(scans[s]->info().name()),
        scans[s]->info().encoding == formats::PositionEncoding::kFloat32 ? "float32" : "float64",
        significant(ledger.precision, 6), significant(longest, 6)));
  }
}

void tell_uncounted_records(const stages::Scans& scans) {
  for (const auto& scan : scans)
    if (scan->info().uncounted_records > 0)
      tell_note(fmt::format(
          "{} has room for {} behind the {} that its header counts; they are not read",
          printable(scan->info().name()), count_of(scan->info().uncounted_records, "more record"),
          with_commas(scan->info().claimed_points)));
}

}  // namespace cairn::pipeline
