// index.bin: what a dataset is and where its nodes lie. A head of fixed layout with the schema, the
// checksums of the pages, then the node records in id order in pages, so that a remote reader fetches
// the head and the top of the tree first. The layout is told in formats/FORMAT.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/node_record.h"
#include "formats/error.h"

namespace cairn::formats {

inline constexpr std::uint32_t kFormatVersion = 1;
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

/// Requires a header that write_index accepts.
IndexLayout layout_of(const DatasetHeader& header);

/// The bytes of index.bin. Throws Error: kUsage where the header is beyond the limits of the format,
/// kInvariant where a record does not fit the header's tree. The result always parses.
std::vector<std::byte> write_index(const DatasetIndex& index);

/// Reads the head from the first bytes of index.bin: at least kIndexFixedBytes, or all if it has fewer.
/// `needed_bytes` tells how many bytes of the file hold the head and the page checksums; given at least
/// so many, the root checksum is verified too, else only the values. Nothing is allocated that the
/// claimed size of the file, `index_size_bytes`, has no room for.
[[nodiscard]] std::optional<DecodeError> parse_index_head(std::span<const std::byte> bytes,
                                                          std::uint64_t index_size_bytes, IndexHead& head,
                                                          std::uint64_t& needed_bytes);

/// Reads one page, against its entry in the table of page checksums, and appends its records.
[[nodiscard]] std::optional<DecodeError> parse_index_page(const IndexHead& head, const IndexLayout& layout,
                                                          std::uint64_t page, std::uint64_t checksum,
                                                          std::span<const std::byte> bytes,
                                                          std::vector<NodeRecord>& nodes);

/// Reads all of index.bin and checks that the sections of the nodes fill nodes.bin without gap or overlap.
[[nodiscard]] std::optional<DecodeError> parse_index(std::span<const std::byte> bytes, DatasetIndex& index);

}  // namespace cairn::formats
