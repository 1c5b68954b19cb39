// Chooses how a schema is written as LAS: the version, the point format, which attributes stand in fields of
// the format and which in extra bytes, and the bytes that come before the points.
// Based on: ASPRS, LAS Specification 1.2 and 1.4 R15.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/scans/las_layout.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

struct LasPlan {
  std::uint8_t version_minor = 2;  ///< 2 or 4
  LasLayout layout;
  std::vector<VariableLengthRecord> vlrs;  ///< in the order of the file
  std::vector<VariableLengthRecord>
      evlrs;  ///< those of more than 65,535 bytes; only with version 1.4
  /// What to put into the byte of the return fields if the schema has neither of them: 1 of 1.
  std::byte default_returns{};
  bool has_wkt = false;

  std::uint64_t point_data_offset() const;
};

/// `wide` asks for a point format of 6 to 10 even if the schema does not need it. Throws kUsage if the
/// attributes do not fit into a record.
LasPlan plan_las(const ScanInfo& description, std::uint64_t expected_points, bool wide);

/// What the header says about the points.
struct LasTotals {
  std::uint64_t points = 0;
  std::array<std::uint64_t, 15> by_return{};  ///< of return number 1, 2, ...
  std::array<std::int32_t, 3> least{};        ///< steps; 0 if there are no points
  std::array<std::int32_t, 3> greatest{};
  std::uint64_t evlr_offset = 0;  ///< 0 if there are none
};

/// The header and the VLRs: point_data_offset() bytes.
std::vector<std::byte> las_preamble(const LasPlan& plan, const ScanInfo& description,
                                    const LasTotals& totals);

/// The EVLRs, one after the other.
std::vector<std::byte> las_evlr_bytes(const LasPlan& plan);

}  // namespace cairn::formats
