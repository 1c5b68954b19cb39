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
#include "stages/import/grid_choice.h"

namespace cairn::stages {

struct ImportOptions {
  std::vector<std::string> drop;              ///< attributes to leave out
  std::optional<double> resolution;           ///< world units: accept a grid step up to this
};

/// What became of one scan's records.
struct ScanLedger {
  std::uint64_t claimed = 0;
  std::uint64_t read = 0;
  std::uint64_t kept = 0;
  std::uint64_t dropped() const { return read - kept; }  ///< non-finite coordinates
  std::uint64_t missing() const { return claimed - read; }
};

/// A dense run of imported records that share one scan's encoding.
struct RecordRun {
  std::size_t scan = 0;
  std::uint64_t first_byte = 0;
  std::uint64_t count = 0;
};

struct ImportedPoints {
  formats::ExternalArray array;
  formats::Schema schema;             ///< of the records, radius last if there is one
  std::size_t native_position_bytes;  ///< 12 or 24: room for a position in front of each record
  std::size_t stride;                 ///< bytes of a record
  std::vector<RecordRun> runs;        ///< in campaign order: by scan, then as in its file
  formats::Grid grid;
  std::vector<PositionMap> maps;      ///< one a scan
  std::vector<ScanLedger> ledger;     ///< one a scan
  formats::GridBox box;               ///< tight box of all points on the grid
  std::uint64_t points = 0;           ///< kept
};

using Scans = std::vector<std::unique_ptr<formats::ScanReader>>;

/// Upper bounds of what the scans bring, told by their headers and checked against their files' sizes.
struct CampaignSize {
  std::uint64_t points = 0;
  std::uint64_t record_bytes = 0;  ///< of one point record on the dataset grid
  std::uint64_t import_bytes = 0;  ///< disk that import_scans reserves
};
CampaignSize campaign_size(const Scans& scans, const ImportOptions& options);

/// Reads every scan. Throws Error (kInput) for damaged scans, no usable point, or a grid that would be
/// too coarse (see choose_grid).
ImportedPoints import_scans(const Scans& scans, const ImportOptions& options, Context& context);

/// Streams the campaign's points as canonical records: 12-byte grid position, then the attributes of
/// `schema`. What verify digests when it is given the inputs. Blocks come in no particular order, from
/// several threads.
using RecordSink = std::function<void(std::span<const std::byte> records, std::size_t stride)>;
void stream_canonical_records(const Scans& scans, const formats::Schema& schema, const formats::Grid& grid,
                              const RecordSink& sink);

}  // namespace cairn::stages
