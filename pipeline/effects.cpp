#include "pipeline/effects.h"

#include <utility>

#include "pipeline/stage_options.h"
#include "stages/filter/filter.h"
#include "stages/split/split.h"

namespace cairn::pipeline {
namespace {

void tell_effects(const stages::FilteredPoints& filtered, formats::MetadataExtras& extras) {
  for (std::size_t e = 0; e < filtered.effects.size(); ++e) {
    const bool balances = filtered.balanced && filtered.names[e] == stages::kExposureEffect;
    extras.effects.push_back({.name = std::string(filtered.names[e]),
                              .removed = filtered.effects[e].removed,
                              .digest = filtered.effects[e].digest,
                              .balanced = balances ? std::string(filtered.balanced->name) : ""});
  }
  for (std::size_t s = 0; s < extras.sources.size(); ++s) {
    const stages::SourceOutcome& outcome = filtered.sources[s];
    formats::SourceSummary& source = extras.sources[s];
    source.kept = outcome.kept;
    source.box = outcome.box;
    source.removed.assign(
        outcome.removed.begin(),
        outcome.removed.begin() + static_cast<std::ptrdiff_t>(filtered.effects.size()));
    if (!filtered.balanced) continue;
    source.gains.assign(
        outcome.gain.begin(),
        outcome.gain.begin() + static_cast<std::ptrdiff_t>(filtered.balanced->components));
    source.clamped = outcome.clamped;
  }
}

void update(std::vector<stages::ScanLedger>& ledger, const stages::FilteredPoints& filtered) {
  for (std::size_t s = 0; s < ledger.size(); ++s) {
    ledger[s].removed = ledger[s].kept - filtered.sources[s].kept;
    ledger[s].kept = filtered.sources[s].kept;
    ledger[s].box = filtered.sources[s].box;
  }
}

}  // namespace

stages::ImportedPoints run_effects(stages::ImportedPoints&& imported, const BuildOptions& options,
                                   bool keep_numbers, bool blocks_are_needed,
                                   formats::MetadataExtras& extras, stages::Context& context) {
  const formats::Tree blocks = effect_blocks(imported.points);
  stages::ImportedPoints left{.array = {},
                              .schema = imported.schema,
                              .native_position_bytes = sizeof(formats::GridPoint),
                              .stride = 0,
                              .numbered = keep_numbers,
                              .runs = {},
                              .grid = imported.grid,
                              .maps = {},
                              .ledger = imported.ledger,
                              .box = {},
                              .points = 0};
  const bool numbered = imported.numbered;
  stages::SplitPoints points;
  points.stride = imported.stride - imported.native_position_bytes + sizeof(formats::GridPoint);
  if (blocks_are_needed)
    points = stages::split(std::move(imported), blocks, context, stages::unit_log::kBlocks);
  stages::FilteredPoints filtered = stages::filter({.records = points.array,
                                                    .stride = points.stride,
                                                    .numbered = numbered,
                                                    .keep_numbers = keep_numbers,
                                                    .grid = left.grid,
                                                    .tree = blocks,
                                                    .schema = left.schema,
                                                    .scans = left.ledger.size()},
                                                   options.filter, context);
  points.array.remove();
  tell_effects(filtered, extras);
  update(left.ledger, filtered);
  left.array = std::move(filtered.array);
  left.stride = filtered.stride;
  left.runs = {{.scan = 0, .first_byte = 0, .count = filtered.points}};
  left.box = filtered.box;
  left.points = filtered.points;
  return left;
}

}  // namespace cairn::pipeline
