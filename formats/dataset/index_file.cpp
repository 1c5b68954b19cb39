#include "formats/dataset/index_file.h"

#include <algorithm>
#include <string>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/record_codec.h"

namespace cairn::formats {
namespace {

/// The bytes that a node's sections fill in nodes.bin; they lie one behind the other.
IndexRange blob_of(const NodeRecord& record) {
  IndexRange range{record.sections.front().offset, 0};
  for (const SectionRef& section : record.sections) range.count += section.size_bytes;
  return range;
}

/// Nodes fill nodes.bin without gap or overlap, coarse to fine: so no byte of it is beyond checksums.
std::optional<DecodeError> check_tiling(const DatasetIndex& index, const IndexLayout& layout) {
  const Tree tree = index.head.dataset.tree();
  std::vector<std::uint64_t> order(index.nodes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::uint64_t i) { return blob_of(index.nodes[i]).first; });
  std::uint64_t end = 0;
  Level level = 0;
  for (const std::uint64_t i : order) {
    const IndexRange blob = blob_of(index.nodes[i]);
    const std::uint64_t at = layout.pages_offset + i * layout.record_size_bytes;
    if (blob.first != end)
      return DecodeError{"nodes overlap or leave a gap", at, std::to_string(blob.first),
                         std::to_string(end)};
    const Level own = tree.level_of(index.nodes[i].id);
    if (own < level)
      return DecodeError{"nodes are not coarse to fine", at, std::to_string(own),
                         std::to_string(level)};
    level = own;
    end = blob.end();
  }
  if (end != index.head.nodes_size_bytes)
    return DecodeError{"bytes behind the last node", 32,
                       std::to_string(index.head.nodes_size_bytes), std::to_string(end)};
  return std::nullopt;
}

void check_nodes(const DatasetIndex& index, const IndexLayout& layout) {
  CAIRN_CHECK(index.nodes.size() == layout.node_count);
  for (std::uint64_t i = 0; i < layout.node_count; ++i)
    CAIRN_CHECK(value_of(index.nodes[i].id) == i);
}

}  // namespace

IndexRange IndexLayout::nodes_of(std::uint64_t page) const {
  const std::uint64_t first = page * records_per_page;
  return {first, std::min(records_per_page, node_count - first)};
}

IndexRange IndexLayout::bytes_of(std::uint64_t page) const {
  const IndexRange records = nodes_of(page);
  return {pages_offset + records.first * record_size_bytes, records.count * record_size_bytes};
}

std::vector<std::byte> write_index(const DatasetIndex& index) {
  check_limits(index.head.dataset);
  const IndexLayout layout = layout_of(index.head.dataset);
  check_nodes(index, layout);
  const Tree tree = index.head.dataset.tree();
  std::vector<std::byte> pages(
      static_cast<std::size_t>(layout.node_count * layout.record_size_bytes));
  for (std::size_t i = 0; i < index.nodes.size(); ++i)
    encode_record(index.head.dataset, tree, index.nodes[i],
                  std::span(pages).subspan(i * layout.record_size_bytes, layout.record_size_bytes));
  std::vector<std::uint64_t> checksums;
  for (std::uint64_t page = 0; page < layout.page_count; ++page) {
    const IndexRange range = layout.bytes_of(page);
    checksums.push_back(
        checksum_of(std::span(pages).subspan(range.first - layout.pages_offset, range.count)));
  }
  std::vector<std::byte> bytes = write_index_head(index.head, checksums);
  bytes.insert(bytes.end(), pages.begin(), pages.end());
  return bytes;
}

std::optional<DecodeError> parse_index_page(const IndexHead& head, const IndexLayout& layout,
                                            std::uint64_t page, std::uint64_t checksum,
                                            std::span<const std::byte> bytes,
                                            std::vector<NodeRecord>& nodes) {
  CAIRN_CHECK(page < layout.page_count);
  const IndexRange range = layout.bytes_of(page);
  if (bytes.size() != range.count)
    return DecodeError{"a page of the index ends early", 0, std::to_string(bytes.size()),
                       std::to_string(range.count)};
  if (const std::uint64_t sum = checksum_of(bytes); sum != checksum)
    return DecodeError{"the checksum of a page of the index does not match", 0, std::to_string(sum),
                       std::to_string(checksum)};
  const Tree tree = head.dataset.tree();
  const IndexRange records = layout.nodes_of(page);
  for (std::uint64_t i = 0; i < records.count; ++i) {
    NodeRecord record;
    const std::size_t at = i * layout.record_size_bytes;
    auto error = decode_record(head.dataset, tree, NodeId{records.first + i}, head.nodes_size_bytes,
                               bytes.subspan(at, layout.record_size_bytes), record);
    if (error) {
      error->byte_offset += at;
      error->what += " of node " + std::to_string(records.first + i);
      return error;
    }
    nodes.push_back(std::move(record));
  }
  return std::nullopt;
}

std::optional<DecodeError> parse_index(std::span<const std::byte> bytes, DatasetIndex& index) {
  index = DatasetIndex{};
  std::vector<std::uint64_t> checksums;
  if (auto error = parse_index_head(bytes, bytes.size(), index.head, checksums)) return error;
  const IndexLayout layout = layout_of(index.head.dataset);
  index.nodes.reserve(layout.node_count);
  for (std::uint64_t page = 0; page < layout.page_count; ++page) {
    const IndexRange range = layout.bytes_of(page);
    auto error = parse_index_page(index.head, layout, page, checksums[page],
                                  bytes.subspan(range.first, range.count), index.nodes);
    if (error) {
      error->byte_offset += range.first;
      return error;
    }
  }
  return check_tiling(index, layout);
}

}  // namespace cairn::formats
