// How imported points travel from the import stage to the split stage, which know nothing of each other.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/dataset/grid.h"
#include "formats/scans/position_map.h"
#include "formats/schema.h"

namespace cairn::stages {

/// What became of one scan's records.
struct ScanLedger {
  std::uint64_t claimed = 0;
  std::uint64_t read = 0;
  std::uint64_t kept = 0;
  std::uint64_t no_return =
      0;                      ///< records that hold no point, such as empty cells of a gridded scan
  std::uint64_t removed = 0;  ///< points that effects have removed
  formats::GridBox box;       ///< tight box of the kept points
  std::uint16_t brightest =
      0;  ///< the largest value of its colors, as the scan has them; 0 without
  /// World units: how far neighbouring numbers of the scan's encoding lie apart at its farthest point, the most of any axis.
  double precision = 0;
  std::uint64_t dropped() const { return read - kept; }
  std::uint64_t non_finite() const {
    return dropped() - no_return - removed;
  }  ///< coordinates are no numbers
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
  bool numbered = false;              ///< a record ends in the number of its scan, a u32
  std::vector<RecordRun> runs;        ///< in campaign order: by scan, then as in its file
  formats::Grid grid;
  std::vector<formats::PositionMap> maps;  ///< one a scan; none: positions are steps of the grid
  std::vector<ScanLedger> ledger;          ///< one a scan
  formats::GridBox box;                    ///< tight box of all points on the grid
  std::uint64_t points = 0;                ///< kept
};

}  // namespace cairn::stages
