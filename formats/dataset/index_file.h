// index.bin: what a dataset is and where its nodes lie. A head of fixed layout with the schema, the
// checksums of the pages, then the node records in id order in pages, so that a remote reader fetches
// the head and the top of the tree first. The layout is told in formats/FORMAT.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/node_record.h"
#include "formats/error.h"

namespace cairn::formats {

/// Versions that are read. A dataset is written in the lowest that can tell it.
inline constexpr std::uint32_t kOldestFormatVersion = 1;
inline constexpr std::uint32_t kFormatVersion = 2;  ///< tells what is estimated from neighbours
/// The version that tells this dataset.
std::uint32_t version_of(const DatasetHeader& header);
/// How index.bin begins: "CAIRN", then bytes that a transfer as text would change, as in PNG.
inline constexpr std::array<std::uint8_t, 8> kIndexSignature{0x43, 0x41, 0x49, 0x52,
                                                             0x4E, 0x0D, 0x0A, 0x1A};
/// The first bytes of index.bin that suffice to know the size of its head.
inline constexpr std::size_t kIndexFixedBytes = 200;

/// What index.bin says besides the node records.
struct IndexHead {
  DatasetHeader dataset;
  std::uint64_t nodes_size_bytes = 0;     ///< of nodes.bin
  std::uint64_t metadata_size_bytes = 0;  ///< of metadata.json
  std::uint64_t metadata_checksum = 0;    ///< XXH3-64 of metadata.json
  friend bool operator==(const IndexHead&, const IndexHead&) = default;
};

struct DatasetIndex {
  IndexHead head;
  std::vector<NodeRecord> nodes;  ///< in id order, all of them
  friend bool operator==(const DatasetIndex&, const DatasetIndex&) = default;
};

/// Where the parts of index.bin lie; follows from the header alone.
struct IndexLayout {
  std::uint64_t head_size_bytes = 0;  ///< the page checksums begin here
  std::uint64_t node_count = 0;
  std::uint64_t record_size_bytes = 0;
  std::uint64_t records_per_page = 0;
  std::uint64_t page_count = 0;
  std::uint64_t pages_offset = 0;
  std::uint64_t size_bytes = 0;  ///< of index.bin

  /// The nodes of page `page` and the bytes where their records lie.
  IndexRange nodes_of(std::uint64_t page) const;
  IndexRange bytes_of(std::uint64_t page) const;
};

/// Whether the format can hold the attribute: its name is of a to z, 0 to 9 and _, normals are 3 floats, the
/// radius is not in the schema.
bool is_valid_attribute(const Attribute& attribute);
/// Throws Error (kUsage) where a header is beyond the limits of the format.
void check_limits(const DatasetHeader& header);

/// Requires a header that check_limits accepts.
IndexLayout layout_of(const DatasetHeader& header);

/// The bytes of index.bin. Throws Error: kUsage where the header is beyond the limits of the format,
/// kInvariant where a record does not fit the header's tree. The result always parses.
std::vector<std::byte> write_index(const DatasetIndex& index);

/// The bytes of the head and of the table of page checksums: index.bin before its pages.
std::vector<std::byte> write_index_head(const IndexHead& head,
                                        std::span<const std::uint64_t> page_checksums);

/// How many bytes at the beginning of index.bin hold its head and the page checksums, told from the
/// first kIndexFixedBytes bytes (or all, if there are fewer) and the file's size. Never more than the file
/// has.
[[nodiscard]] std::optional<DecodeError> index_prefix_size(std::span<const std::byte> bytes,
                                                           std::uint64_t index_size_bytes,
                                                           std::uint64_t& prefix_size_bytes);

/// The root checksum as it is written. Requires kIndexFixedBytes bytes or more.
std::uint64_t index_root_checksum(std::span<const std::byte> bytes);

/// Reads the head and the page checksums; `bytes` are the prefix, or more. Verifies the root checksum
/// before anything else.
[[nodiscard]] std::optional<DecodeError> parse_index_head(
    std::span<const std::byte> bytes, std::uint64_t index_size_bytes, IndexHead& head,
    std::vector<std::uint64_t>& page_checksums);

/// Reads one page, against its entry in the table of page checksums, and appends its records.
[[nodiscard]] std::optional<DecodeError> parse_index_page(
    const IndexHead& head, const IndexLayout& layout, std::uint64_t page, std::uint64_t checksum,
    std::span<const std::byte> bytes, std::vector<NodeRecord>& nodes);

/// Reads all of index.bin and checks that the sections of the nodes fill nodes.bin without gap or overlap.
[[nodiscard]] std::optional<DecodeError> parse_index(std::span<const std::byte> bytes,
                                                     DatasetIndex& index);

}  // namespace cairn::formats
