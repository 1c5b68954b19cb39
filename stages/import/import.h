// Import: all scans in parallel into one external array of point records, with exact counts and boxes.
// Positions stay in their scan's own encoding, since the dataset grid can only be fixed once every scan
// has been read; the first pass of the split maps them (stages/split).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/grid.h"
#include "formats/scans/scan_reader.h"
#include "stages/context.h"
#include "stages/imported_points.h"
#include "stages/record_stream.h"

namespace cairn::stages {

struct ImportOptions {
  std::vector<std::string> drop;     ///< attributes to leave out
  std::vector<std::string> keep;     ///< if not empty: all others are left out
  std::optional<double> resolution;  ///< world units: accept a grid step up to this
  bool number_scans = false;         ///< each record ends in the number of its scan, a u32
};

using Scans = std::vector<std::unique_ptr<formats::ScanReader>>;

/// Upper bounds of what the scans bring, told by their headers and checked against their files' sizes.
struct CampaignSize {
  formats::Schema schema;  ///< as in ImportedPoints
  std::uint64_t points = 0;
  std::uint64_t record_bytes = 0;  ///< of one point record on the dataset grid
  std::uint64_t import_bytes = 0;  ///< disk that import_scans reserves
};
CampaignSize campaign_size(const Scans& scans, const ImportOptions& options);

/// Reads every scan. Throws Error (kInput) for damaged scans, no usable point, or a grid that would be
/// too coarse (see fitted_grid).
ImportedPoints import_scans(const Scans& scans, const ImportOptions& options, Context& context);

/// Streams the campaign's points as canonical records: 12-byte grid position, then the attributes of `schema`. What
/// verify digests when it is given the inputs. Blocks are each of one scan, and the sink's to change; they come in no
/// particular order, from as many threads as the context's memory has room for.
using ScanRecordSink =
    std::function<void(std::size_t scan, std::span<std::byte> records, std::size_t stride)>;
void stream_canonical_records(const Scans& scans, const formats::Schema& schema,
                              const formats::Grid& grid, const Context& context,
                              const ScanRecordSink& sink);

}  // namespace cairn::stages
