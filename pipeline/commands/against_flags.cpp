#include "pipeline/commands/against_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "formats/dataset/digest.h"
#include "formats/error.h"
#include "pipeline/campaign.h"
#include "pipeline/memory_budget.h"
#include "pipeline/scan_gains.h"

namespace cairn::pipeline {

AgainstFlags::AgainstFlags(CLI::App& parser, const char* help) {
  parser.add_option("--against", against_, help)->option_text("SCANS");
  for (const char* key : {"folder", "poses", "poses_tell", "allow_truncated", "columns"})
    flags_.push_back(declare_flag(parser, *find_setting(key)));
}

stages::Scans AgainstFlags::open() const {
  SettingLayer flags = given_flags(flags_);
  if (against_.empty()) {
    if (!flags.empty())
      formats::throw_usage(flags.begin()->second.origin + " tells of scans: --against them");
    return {};
  }
  std::optional<std::filesystem::path> config;
  if (std::any_of(against_.begin(), against_.end(),
                  [](const std::string& path) { return path.ends_with(".toml"); })) {
    if (against_.size() > 1)
      formats::throw_usage("--against takes one configuration file, or scans");
    config = against_.front();
  }
  if (!config) flags["scans"] = {against_, "--against"};
  CampaignOptions campaign = resolve_campaign(flags, config);
  campaign.memory_bytes = memory_budget(0, machine_memory_bytes());
  return open_campaign(campaign);
}

std::optional<stages::RecordSource> source_of(const stages::Scans& scans,
                                              const formats::DatasetReader& dataset,
                                              const stages::Context& context) {
  if (scans.empty()) return std::nullopt;
  return [&scans, &dataset, &context](const stages::RecordSink& sink) {
    const formats::Schema schema = formats::digest_schema(dataset.header());
    const ScanGains gains(dataset.metadata(), schema, scans);
    stages::stream_canonical_records(
        scans, schema, dataset.header().grid, context,
        [&](std::size_t scan, std::span<std::byte> records, std::size_t stride) {
          gains.apply(scan, records, stride);
          sink(records, stride);
        });
  };
}

}  // namespace cairn::pipeline
