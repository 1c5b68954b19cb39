#include "stages/filter/filter.h"

#include <utility>

#include "formats/checksum.h"
#include "formats/error.h"
#include "stages/filter/compaction.h"
#include "stages/filter/effect.h"
#include "stages/parallel.h"
#include "stages/unit_state.h"

namespace cairn::stages {

using formats::ExternalArray;

namespace {

/// One unit: all effects and what is left after them.
constexpr std::string_view kUnits = unit_log::kFilter;
constexpr std::uint64_t kChecksumBytes = std::uint64_t{8} << 20;

std::vector<std::uint64_t> checksums_of(ExternalArray& array) {
  const std::uint64_t pieces = (array.size_bytes() + kChecksumBytes - 1) / kChecksumBytes;
  std::vector<std::uint64_t> checksums(pieces);
  for_each_piece(pieces, [&](std::uint64_t i) {
    const std::uint64_t at = i * kChecksumBytes;
    const std::uint64_t size_bytes = std::min(kChecksumBytes, array.size_bytes() - at);
    checksums[i] = formats::checksum_of(array.bytes().subspan(at, size_bytes));
    array.release(at, size_bytes);
  });
  return checksums;
}

void remember(const Context& context, FilteredPoints& points) {
  finish_unit(context, kUnits, kStageDone,
              StateWriter()
                  .put(std::uint64_t{points.stride})
                  .put(points.points)
                  .put(points.box)
                  .put(points.sources)
                  .put(points.effects)
                  .put(checksums_of(points.array))
                  .bytes());
}

/// What an earlier run has left. Records that are not there, or damaged, are none: the split may be done with them, and
/// tells if it is not.
std::optional<FilteredPoints> recall(const Context& context) {
  const auto state = finished_unit(context, kUnits, kStageDone);
  if (!state) return std::nullopt;
  FilteredPoints points;
  std::uint64_t stride = 0;
  std::vector<std::uint64_t> checksums;
  StateReader reader(*state);
  reader.get(stride);
  reader.get(points.points);
  reader.get(points.box);
  reader.get(points.sources);
  reader.get(points.effects);
  reader.get(checksums);
  points.stride = stride;
  auto found = find_array(context, "filter", points.points * stride);
  if (found && checksums_of(*found) == checksums) points.array = std::move(*found);
  return points;
}

FilteredPoints run_effects(const FilterInput& input,
                           const std::vector<std::unique_ptr<Effect>>& effects,
                           const std::optional<formats::BalancedColumn>& balanced,
                           Context& context) {
  if (input.records.size_bytes() == 0) throw WorkLost{};
  const std::uint64_t points = input.tree.points();
  Cloud cloud{.leaves = LeafRecords(input.records, input.stride, input.tree),
              .grid = input.grid,
              .boxes = {},
              .numbered = input.numbered,
              .scans = input.scans,
              .marks = context.make_array("marks", points),
              .balanced = balanced,
              .gains = {}};
  run_in_arena(context.threads, [&] { cloud.boxes = cloud.leaves.boxes(context); });
  for (std::size_t e = 0; e < effects.size(); ++e) {
    context.progress->begin(effects[e]->name(), points);
    effects[e]->act(cloud, static_cast<std::uint8_t>(e + 1), context);
    context.progress->end();
  }
  FilteredPoints left = compact(cloud, effects.size(), input.keep_numbers, context);
  cloud.marks.remove();
  return left;
}

}  // namespace

std::vector<std::unique_ptr<Effect>> make_effects(const FilterOptions& options) {
  std::vector<std::unique_ptr<Effect>> effects;
  if (options.duplicates != Duplicates::kKept)
    effects.push_back(make_duplicate_removal(options.duplicates));
  if (options.outlier_deviations)
    effects.push_back(make_outlier_removal(*options.outlier_deviations, options.outlier_neighbors));
  if (options.balance_exposure) effects.push_back(make_exposure_balance());
  if (options.thin) effects.push_back(make_thinning(*options.thin));
  CAIRN_CHECK(effects.size() <= kMostEffects);
  return effects;
}

formats::BalancedColumn require_balanced_column(const formats::Schema& schema) {
  const auto column = formats::balanced_column(schema);
  if (!column)
    formats::throw_usage(
        "balance_exposure: the scans bring neither color nor intensity of 8 or 16 bits");
  return *column;
}

FilteredPoints filter(const FilterInput& input, const FilterOptions& options, Context& context) {
  CAIRN_CHECK(options.any());
  const auto effects = make_effects(options);
  std::optional<formats::BalancedColumn> balanced;
  if (options.balance_exposure) balanced = require_balanced_column(input.schema);
  FilteredPoints points;
  if (auto known = recall(context)) {
    points = std::move(*known);
  } else {
    points = run_effects(input, effects, balanced, context);
    remember(context, points);
  }
  points.balanced = balanced;
  for (const auto& effect : effects) points.names.push_back(effect->name());
  return points;
}

}  // namespace cairn::stages
