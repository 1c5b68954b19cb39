#include "formats/dataset/dataset_reader.h"

#include <span>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/metadata.h"

namespace cairn::formats {
namespace {

[[noreturn]] void refuse(const DecodeError& error, const std::filesystem::path& path,
                         std::uint64_t base = 0) {
  throw_input({.what = error.what,
               .path = path,
               .offset = base + error.byte_offset,
               .found = error.found,
               .expected = error.expected});
}

DatasetIndex read_index(const RandomAccessFile& file) {
  // The file's own size is compared with what its head claims before the whole is read.
  std::vector<std::byte> bytes(kIndexFixedBytes);
  bytes.resize(file.read_at_most(0, bytes));
  std::uint64_t prefix = 0;
  if (const auto error = index_prefix_size(bytes, file.size_bytes(), prefix))
    refuse(*error, file.path());
  bytes.resize(static_cast<std::size_t>(file.size_bytes()));
  file.read_exactly(0, bytes);
  DatasetIndex index;
  if (const auto error = parse_index(bytes, index)) refuse(*error, file.path());
  return index;
}

void check_size(const RandomAccessFile& file, std::uint64_t expected) {
  if (file.size_bytes() != expected)
    throw_input({.what = "the file has not the size that the index tells",
                 .path = file.path(),
                 .found = std::to_string(file.size_bytes()) + " bytes",
                 .expected = std::to_string(expected) + " bytes"});
}

std::string read_metadata(const std::filesystem::path& path, const IndexHead& head) {
  const RandomAccessFile file(path);
  check_size(file, head.metadata_size_bytes);
  std::string text(static_cast<std::size_t>(file.size_bytes()), '\0');
  file.read_exactly(0, std::as_writable_bytes(std::span(text)));
  const std::uint64_t sum = checksum_of(std::as_bytes(std::span(text)));
  if (sum != head.metadata_checksum)
    throw_input({.what = "the checksum of the metadata does not match",
                 .path = path,
                 .found = std::to_string(sum),
                 .expected = std::to_string(head.metadata_checksum)});
  if (const auto error = check_metadata_text(text)) refuse(*error, path);
  return text;
}

}  // namespace

DatasetReader DatasetReader::open(const std::filesystem::path& directory) {
  const RandomAccessFile index_file(directory / dataset_file::kIndex);
  DatasetIndex index = read_index(index_file);
  std::string metadata = read_metadata(directory / dataset_file::kMetadata, index.head);
  RandomAccessFile nodes(directory / dataset_file::kNodes);
  check_size(nodes, index.head.nodes_size_bytes);
  return DatasetReader(std::move(nodes), std::move(index), std::move(metadata),
                       index_file.size_bytes());
}

DatasetReader::DatasetReader(RandomAccessFile nodes, DatasetIndex index, std::string metadata,
                             std::uint64_t index_size_bytes)
    : nodes_file_(std::move(nodes)),
      index_(std::move(index)),
      tree_(index_.head.dataset.tree()),
      metadata_(std::move(metadata)),
      index_size_bytes_(index_size_bytes) {}

const NodeRecord& DatasetReader::record(NodeId id) const {
  CAIRN_CHECK(value_of(id) < index_.nodes.size());
  return index_.nodes[value_of(id)];
}

IndexRange DatasetReader::representatives_of(NodeId id) const {
  if (value_of(id) == 0) return {};
  const NodeRecord& parent = record(tree_.parent(id));
  const std::size_t child = (value_of(id) - 1) % tree_.fanout();
  return {parent.block_start[child], parent.block_start[child + 1] - parent.block_start[child]};
}

NodeData DatasetReader::read_node(NodeId id, const SectionSet& wanted) const {
  const std::filesystem::path& path = nodes_file_.path();
  const NodeRecord& node = record(id);
  std::vector<std::vector<std::byte>> buffers(node.sections.size());
  std::vector<std::span<const std::byte>> bytes(node.sections.size());
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const SectionRef& section = node.sections[i];
    if (!wanted[i] || section.size_bytes == 0) continue;
    buffers[i].resize(section.size_bytes);
    nodes_file_.read_exactly(section.offset, buffers[i]);
    if (const std::uint64_t sum = checksum_of(buffers[i]); sum != section.checksum)
      throw_input({.what = "the checksum of section " + std::to_string(i) + " of node " +
                           std::to_string(value_of(id)) + " does not match",
                   .path = path,
                   .offset = section.offset,
                   .found = std::to_string(sum),
                   .expected = std::to_string(section.checksum)});
    bytes[i] = buffers[i];
  }
  NodeData points;
  std::size_t failed = 0;
  if (const auto error =
          decode_node(header(), node, representatives_of(id), bytes, wanted, points, failed))
    refuse(*error, path, node.sections[failed].offset);
  return points;
}

}  // namespace cairn::formats
