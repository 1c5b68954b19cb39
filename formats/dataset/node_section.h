// A section of a node: one column as stored in nodes.bin, filtered and compressed.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point
// Models Using Multi-way kd-Trees", 2010, section III.C, where each attribute of a node is compressed
// with LZO by itself. Where it departs: a filter chosen for each column comes before the compressor,
// which is left out where it does not pay.
//
// Bytes: u8 filter (filters.h), u8 codec (codec.h); if the codec is not none, u32 size of the filtered
// column; then the filtered column, compressed by the codec. Type, components and number of points are
// not repeated: the index and the schema have them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/codec.h"
#include "formats/dataset/column.h"
#include "formats/dataset/filters.h"
#include "formats/error.h"

namespace cairn::formats {

/// The section of a column. The same column, shape and codec always give the same bytes. With Codec::kNone
/// the column is filtered only. At most 2 bytes larger than the column. Requires column.size() ==
/// shape.size_bytes() <= 2^30, 1 <= shape.components <= 255.
std::vector<std::byte> encode_section(std::span<const std::byte> column, const ColumnShape& shape,
                                      Codec codec);

/// Restores the column, bit by bit, from exactly the bytes of a section. Requires column.size() ==
/// shape.size_bytes(). Whatever `section` holds, nothing outside of the spans is read or written and no
/// more work memory is taken than a small multiple of the column; after an error the content of `column`
/// is unspecified. `byte_offset` of an error counts from the start of the section, or, behind the codec,
/// from the start of the filtered column, and `what` says so.
[[nodiscard]] std::optional<DecodeError> decode_section(std::span<const std::byte> section,
                                                        const ColumnShape& shape,
                                                        std::span<std::byte> column);

/// How a section is stored, for reports.
struct SectionStorage {
  Filter filter;
  Codec codec;
};
std::optional<SectionStorage> storage_of(std::span<const std::byte> section);

}  // namespace cairn::formats
