// One node record to and from its bytes in index.bin. The layout is told in formats/FORMAT.md, "Node
// record"; its size is the same for all nodes of a dataset.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/dataset/node_record.h"
#include "formats/error.h"
#include "formats/limits.h"

namespace cairn::formats {

/// Limits of the format, so that nothing that a file claims can overflow or exhaust memory.
inline constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 48;
inline constexpr std::uint64_t kMaxNodePoints = std::uint64_t{1} << 24;
/// Bytes of one decoded column of a node.
inline constexpr std::uint64_t kMaxColumnBytes = std::uint64_t{1} << 30;
/// Bytes of all decoded columns of a node together.
inline constexpr std::uint64_t kMaxNodeBytes = std::uint64_t{1} << 32;
inline constexpr std::size_t kMaxSections = kFirstAttributeSection + kMaxAttributes;

/// Marks "no such node" in the fields parent and first_child.
inline constexpr std::uint64_t kNoNode = UINT64_MAX;

/// Bytes of a record before its block starts and sections.
inline constexpr std::size_t kRecordFixedBytes = 168;
inline constexpr std::size_t kSectionRefBytes = 24;

std::size_t section_count(const DatasetHeader& header);
/// Whether nodes of this kind have the section at all.
bool has_section(const DatasetHeader& header, std::size_t section, bool root, bool leaf);
/// Bytes of every record of the dataset, a multiple of 8.
std::size_t record_size_bytes(const DatasetHeader& header);

/// Writes a record. Requires out.size() == record_size_bytes(header), N + 1 block starts and
/// section_count(header) sections.
void encode_record(const DatasetHeader& header, const Tree& tree, const NodeRecord& record,
                   std::span<std::byte> out);

/// Reads the record of node `id` and checks all that can be checked of it alone: what the tree's
/// arithmetic implies (id, parent, children, level, points of a leaf), enums, ranges, finite numbers,
/// which sections are there, and that they lie one behind the other within `nodes_size_bytes`.
/// Requires bytes.size() == record_size_bytes(header) and a header that index_file has checked. Offsets
/// of errors count from the record's start.
[[nodiscard]] std::optional<DecodeError> decode_record(const DatasetHeader& header,
                                                       const Tree& tree, NodeId id,
                                                       std::uint64_t nodes_size_bytes,
                                                       std::span<const std::byte> bytes,
                                                       NodeRecord& record);

}  // namespace cairn::formats
