#include "pipeline/dataset_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "formats/scans/crs.h"
#include "pipeline/scan_facts.h"
#include "pipeline/stage_options.h"

namespace cairn::pipeline {
namespace {

/// What became of a scan; its CRS records are added to those known, each once.
formats::SourceSummary summary_of(const formats::ScanInfo& info, const stages::ScanLedger& ledger,
                                  std::vector<formats::VariableLengthRecord>& crs) {
  formats::SourceSummary summary{.name = info.name(),
                                 .format = info.format,
                                 .claimed = ledger.claimed,
                                 .kept = ledger.kept,
                                 .non_finite = ledger.non_finite(),
                                 .no_return = ledger.no_return,
                                 .missing = ledger.missing(),
                                 .uncounted_records = info.uncounted_records,
                                 .box = ledger.box,
                                 .precision = ledger.precision,
                                 .crs = {},
                                 .replaced_crs = {}};
  for (const formats::VariableLengthRecord& record : info.crs) {
    const auto known = std::find(crs.begin(), crs.end(), record);
    summary.crs.push_back(static_cast<std::size_t>(known - crs.begin()));
    if (known == crs.end()) crs.push_back(record);
  }
  return summary;
}

std::vector<std::string> estimated_names(const BuildOptions& options) {
  std::vector<std::string> names;
  if (options.estimate_normals) names.emplace_back("normals");
  if (options.estimate_radii) names.emplace_back("radii");
  return names;
}

/// Of the effects that are called for.
void add_filter_parameters(const stages::FilterOptions& filter, formats::MetadataExtras& extras) {
  const auto add = [&](const char* name, std::string text) {
    extras.parameters.emplace_back(name, std::move(text));
  };
  if (filter.duplicates != stages::Duplicates::kKept)
    add("remove_duplicates",
        filter.duplicates == stages::Duplicates::kExact ? "\"exact\"" : "\"position\"");
  if (filter.outlier_deviations) {
    add("outlier_deviations", fmt::format("{}", *filter.outlier_deviations));
    add("outlier_neighbors", fmt::format("{}", filter.outlier_neighbors));
  }
  if (filter.balance_exposure) add("balance_exposure", "true");
  if (filter.thin) add("thin", fmt::format("{}", *filter.thin));
}

}  // namespace

formats::DatasetHeader make_header(const BuildOptions& options,
                                   const stages::ImportedPoints& imported,
                                   const formats::Tree& tree) {
  formats::DatasetHeader header;
  header.grid = imported.grid;
  header.points = imported.points;
  header.fanout = tree.fanout();
  header.target_points = tree.target_points();
  header.schema = imported.schema;
  if (formats::find_attribute(header.schema, formats::attribute_name::kRadius)) {
    header.radius_origin = formats::RadiusOrigin::kInput;
    header.schema.pop_back();  // the radius is the last, see merge_schemas
  }
  if (options.estimate_normals)
    header.schema.push_back({.name = std::string(formats::attribute_name::kNormal),
                             .type = formats::ScalarType::kF32,
                             .components = 3,
                             .rule = formats::ReduceRule::kNormal,
                             .estimated = true});
  if (options.estimate_radii) header.radius_origin = formats::RadiusOrigin::kNeighbors;
  header.lossless_leaves = options.lossless_leaves;
  header.position_bits = options.position_bits;
  for (const stages::ScanLedger& scan : imported.ledger) {
    header.read_points += scan.read;
    header.dropped_points += scan.dropped();
    if (__builtin_add_overflow(header.missing_points, scan.missing(), &header.missing_points))
      formats::throw_input(
          {.what = "the headers of the scans claim more points than can be counted",
           .expected = "fewer than 2^64 together"});
  }
  return header;
}

formats::MetadataExtras make_extras(const BuildOptions& options, const stages::Scans& scans,
                                    const formats::Schema& schema,
                                    const std::vector<stages::ScanLedger>& ledger) {
  formats::MetadataExtras extras;
  extras.details = common_details(scans, schema);
  extras.color_bits = color_bits_of(scans, schema, ledger);
  using Json = nlohmann::json;
  const auto text = [](const Json& value) { return value.dump(); };
  const auto number = [](auto value) {
    return fmt::format("{}", value);
  };  // 15, where JSON has 15.0
  const auto number_or_auto = [](const auto& value) { return value ? Json(*value) : Json("auto"); };
  extras.parameters = {{"fanout", text(number_or_auto(options.fanout))},
                       {"node_points", text(options.node_points)},
                       {"grid", text(number_or_auto(options.grid))},
                       {"estimate", text(estimated_names(options))},
                       {"neighbors", estimates(options) ? text(options.neighbors) : "null"},
                       {"theta", number(options.theta_degrees)},
                       {"theta_relaxation", number(options.theta_relaxation)},
                       {"refinement", text(options.refinement)},
                       {"reducer", text(options.reducer)},
                       {"position_bits", text(options.position_bits)},
                       {"lossless_leaves", text(options.lossless_leaves)},
                       {"codec", text(formats::name_of(options.codec))},
                       {"drop", text(options.drop)},
                       {"keep", text(options.keep)},
                       {"resolution", options.resolution ? number(*options.resolution) : "null"}};
  add_filter_parameters(options.filter, extras);
  for (std::size_t s = 0; s < scans.size(); ++s)
    extras.sources.push_back(summary_of(scans[s]->info(), ledger[s], extras.crs));
  if (!options.crs.empty()) {
    extras.replaced_crs = std::exchange(extras.crs, *formats::crs_records(options.crs));
    for (formats::SourceSummary& source : extras.sources)
      source.replaced_crs = std::exchange(source.crs, {});
  }
  return extras;
}

}  // namespace cairn::pipeline
