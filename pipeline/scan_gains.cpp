#include "pipeline/scan_gains.h"

#include <algorithm>

#include "formats/dataset/effect_metadata.h"

namespace cairn::pipeline {

ScanGains::ScanGains(std::string_view metadata, const formats::Schema& schema,
                     const stages::Scans& scans)
    : gains_(scans.size()) {
  formats::ToldEffects told;
  if (formats::read_metadata_effects(metadata, told) || told.balanced.empty()) return;
  const auto column = formats::balanced_column(schema);
  if (!column || column->name != told.balanced) return;
  column_ = column;
  const auto take = [&](std::size_t scan, auto source) {
    if (source->gains.size() == column_->components) gains_[scan] = std::move(source->gains);
    told.sources.erase(source);
  };
  std::vector<std::size_t> unknown;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const auto source = std::ranges::find(told.sources, scans[s]->info().name(),
                                          &formats::ToldEffects::Source::name);
    if (source != told.sources.end())
      take(s, source);
    else
      unknown.push_back(s);
  }
  for (const std::size_t s : unknown)
    if (!told.sources.empty()) take(s, told.sources.begin());
}

void ScanGains::apply(std::size_t scan, std::span<std::byte> records, std::size_t stride) const {
  if (column_ && !gains_[scan].empty())
    formats::apply_gains(records, stride, *column_, gains_[scan]);
}

}  // namespace cairn::pipeline
