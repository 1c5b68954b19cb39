// The variable length records of a LAS file: those that tell the coordinate reference system, and
// the one that describes extra bytes. Points matter more than these records: those that do not fit
// between the header and the points are left out.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/las_header.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

inline constexpr std::uint16_t kExtraBytesRecordId = 4;  ///< of user id LASF_Spec

/// Whether the record tells the CRS: LASF_Projection 2111, 2112 (WKT), 34735, 34736, 34737
/// (GeoTIFF).
bool is_crs_record(const VariableLengthRecord& record);
/// Whether it is one of the two WKT records.
bool is_wkt_record(const VariableLengthRecord& record);

struct LasRecords {
  std::vector<VariableLengthRecord> crs;  ///< in file order, VLRs before EVLRs
  std::vector<std::byte>
      extra_bytes;               ///< payload of the LASF_Spec/4 record; empty if there is none
  std::uint64_t kept_bytes = 0;  ///< memory that all of these take, about; bounded
};

/// Reads the records before and (LAS 1.4) behind the points. `points_end` is the end of the point
/// records that are read. Throws kInput for EVLRs that overlap the points or the end of the file, unless
/// `allow_truncated`: then those are left out.
LasRecords read_las_records(const RandomAccessFile& file, const LasHeader& header,
                            std::uint64_t points_end, bool allow_truncated);

}  // namespace cairn::formats
