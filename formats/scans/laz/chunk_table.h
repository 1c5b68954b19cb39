// Where the chunks of a LAZ file lie and how many points each holds.
// Based on: M. Isenburg, "LASzip: lossless compression of LiDAR data", 2013, and the LASzip
// specification of 2017. Nothing that the table or a chunk claims is believed before it is held
// against the file's size and the header.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/las_header.h"
#include "formats/scans/laz/laszip_record.h"

namespace cairn::formats {

struct LazChunk {
  std::uint64_t offset = 0;
  std::uint64_t size_bytes = 0;
  std::uint32_t points = 0;
};

struct LazChunks {
  std::vector<LazChunk> chunks;  ///< none without points, in the order of the file
  std::uint64_t points = 0;      ///< of all chunks, at most the header's
  std::uint64_t end = 0;         ///< offset of the first byte behind them
};

/// Reads the chunk table. Throws kInput for one that is damaged or contradicts the file or its header.
/// Where the file ends before the table does, `allow_truncated` finds the whole chunks without it if the
/// encoding is layered; pointwise chunks cannot be told apart without the table.
LazChunks read_chunk_table(const RandomAccessFile& file, const LasHeader& header,
                           const LazEncoding& encoding, bool allow_truncated);

/// Checks what a layered chunk says about itself at its begin: its points and the sizes of its layers,
/// which add up to its own. Throws kInput.
void check_layered_chunk(const RandomAccessFile& file, const LasHeader& header,
                         const LazEncoding& encoding, const LazChunk& chunk);

}  // namespace cairn::formats
