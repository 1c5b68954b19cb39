// The record that says how the points of a LAZ file are compressed (VLR "laszip encoded" 22204).
// Based on: M. Isenburg, "LASzip: lossless compression of LiDAR data", 2013, and the LASzip
// specification of 2017 for the point formats of LAS 1.4.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/random_access_file.h"
#include "formats/scans/las_header.h"

namespace cairn::formats {

struct LazEncoding {
  /// Layered: one stream of bytes a field, behind their sizes; else all fields in one stream.
  bool layered = false;
  /// Points of every chunk but the last; 0 if the chunk table tells.
  std::uint32_t chunk_points = 0;
  /// Version 4 of the layered items with fields beyond those of point format 6.
  bool follows_channels = false;
  std::size_t layers = 0;  ///< layered only
};

/// Finds and checks the record. Throws kInput, naming the format, compressor, coder or item, for what
/// is damaged or cannot be decoded here: waveforms (point formats 4, 5, 9, 10), the compressor without
/// chunks of LASzip 1, anything unknown.
LazEncoding read_laszip_record(const RandomAccessFile& file, const LasHeader& header);

}  // namespace cairn::formats
