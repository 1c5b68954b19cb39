// How the fields of a LAS point record and the attributes of a schema correspond, and the loops
// that move whole blocks between the two. The reader decodes with it, the writer encodes. Based on:
// ASPRS, LAS Specification 1.4 R15, point data record formats 0 to 10.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/point_block.h"
#include "formats/schema.h"

namespace cairn::formats {

inline constexpr std::uint8_t kMaxLasPointFormat = 10;

/// Bytes of a record of this point format (0 to 10) without extra bytes.
std::size_t las_point_size(std::uint8_t point_format);

/// Whether the format has the wide bit fields of LAS 1.4 (4-bit return numbers, 8-bit classes).
inline bool las_is_wide(std::uint8_t point_format) { return point_format >= 6; }

/// Byte offset in the record of an optional field; 0 if the format lacks it.
struct LasFieldOffsets {
  std::size_t gps_time = 0;
  std::size_t color = 0;
  std::size_t near_infrared = 0;
  std::size_t waveform = 0;
};
LasFieldOffsets las_field_offsets(std::uint8_t point_format);

/// How an attribute stands in the record. `k...3`, `k...5` are the bit fields of formats 0 to 5,
/// `k...4` those of 6 to 10.
enum class LasCoding : std::uint8_t {
  kCopy,           ///< the bytes as they are
  kReturnNumber3,  ///< bits 0-2
  kReturnCount3,   ///< bits 3-5
  kScanFlags2,     ///< bits 6-7: direction, edge of flight line
  kClass5,         ///< bits 0-4
  kClassFlags3,    ///< bits 5-7: synthetic, key, withheld
  kReturnNumber4,  ///< bits 0-3
  kReturnCount4,   ///< bits 4-7
  kClassFlags4,    ///< bits 0-3
  kScanFlags4,     ///< bits 4-5 scanner channel, 6 direction, 7 edge
  kColor8,         ///< three 8-bit values in 16-bit fields, times 257
  kWiden8,         ///< one 8-bit value in a 16-bit field
};

struct LasColumn {
  std::size_t attribute = 0;  ///< index in the schema
  LasCoding coding = LasCoding::kCopy;
  std::size_t offset_bytes = 0;  ///< in the record
  std::size_t size_bytes = 0;    ///< of the attribute, kCopy only
};

struct LasLayout {
  std::uint8_t point_format = 0;
  std::size_t record_length_bytes = 0;
  std::vector<LasColumn> columns;
};

/// The attributes that a point format always has, and where they stand. Extra bytes may be
/// appended.
void append_las_fields(std::uint8_t point_format, Schema& schema, LasLayout& layout);

/// Decodes whole records into the points from `first` on of a block that was
/// resized (resize_block) to hold them.
void decode_las_records(const LasLayout& layout, std::span<const std::byte> records,
                        std::size_t first, PointBlock& block);

/// The reverse: fills zeroed records with the points from `first` on of a block with integer steps. Returns
/// the index in `layout.columns` of the first column with a value that its bit field cannot hold, or
/// layout.columns.size() if all fit.
[[nodiscard]] std::size_t encode_las_records(const LasLayout& layout, const PointBlock& block,
                                             std::size_t first, std::span<std::byte> records);

}  // namespace cairn::formats
