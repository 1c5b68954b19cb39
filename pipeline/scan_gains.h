// The gains by which a dataset's points were balanced, for the scans at hand.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/dataset/gain.h"
#include "formats/schema.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

class ScanGains {
 public:
  /// `schema` is that of the records to come. Scans are found among the sources that `metadata` tells by their names,
  /// those of one name, and those whose names are no text, in their order. Where the metadata tells of no gains that
  /// fit, there are none.
  ScanGains(std::string_view metadata, const formats::Schema& schema, const stages::Scans& scans);

  /// Applies those of a scan to its records.
  void apply(std::size_t scan, std::span<std::byte> records, std::size_t stride) const;

 private:
  std::optional<formats::BalancedColumn> column_;
  std::vector<formats::Gains> gains_;  ///< of each scan; empty: none
};

}  // namespace cairn::pipeline
