// A node's points to and from the sections of nodes.bin: quantised, filtered, compressed, each section
// by itself. The encodings are told in formats/FORMAT.md, "Sections".
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/codec.h"
#include "formats/dataset/node_data.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/record_codec.h"
#include "formats/error.h"

namespace cairn::formats {

/// Which sections of a node are wanted, by SectionIndex.
using SectionSet = std::bitset<kMaxSections>;
inline SectionSet all_sections() { return SectionSet().set(); }

/// Encodes a node. Fills position_bits, position_box, radius_min, radius_max, point_count and sections
/// (offsets count from the start of the result) of `record`; the rest is left alone. Requires columns
/// of the right sizes, in leaves non-decreasing representatives (kInvariant otherwise), and at most
/// kMaxNodePoints points (kUsage otherwise). The smallest representative named is taken for the first of
/// the parent's block.
std::vector<std::byte> encode_node(const NodeData& points, const DatasetHeader& header, bool leaf,
                                   Codec codec, NodeRecord& record);

/// Decodes the wanted sections of a node; columns that are absent or not wanted stay empty. `bytes` has
/// an entry for each section of the record, those of sections not wanted may be empty.
/// `representatives` are the points of the parent's block for this node (count 0 for the root).
/// Requires a header and a record as parse_index accepts them. Section bytes are refused where they are
/// wrong, never trusted; `byte_offset` of an error counts from the start of section `failed_section`.
[[nodiscard]] std::optional<DecodeError> decode_node(
    const DatasetHeader& header, const NodeRecord& record, IndexRange representatives,
    std::span<const std::span<const std::byte>> bytes, const SectionSet& wanted, NodeData& points,
    std::size_t& failed_section);

}  // namespace cairn::formats
