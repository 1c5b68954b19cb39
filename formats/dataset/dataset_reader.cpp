#include "formats/dataset/dataset_reader.h"

#include <algorithm>
#include <span>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/metadata.h"

namespace cairn::formats {
namespace {

/// Of one node: nothing of it can be used before all of it is there.
std::uint64_t most_node_bytes(const DatasetReader& dataset, const SectionSet& wanted) {
  std::uint64_t most = 0;
  if (!dataset.is_remote()) return most;
  for (const NodeRecord& node : dataset.nodes()) {
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < node.sections.size(); ++i)
      if (wanted[i]) bytes += node.sections[i].size_bytes;
    most = std::max(most, bytes);
  }
  return most;
}

/// What is asked for first of a remote dataset, all at once: of most all of the index (400 nodes, which is 26 million points)
/// and of the metadata; of the nodes a byte, which tells that they are there, and how many bytes.
constexpr std::size_t kIndexFront = 256 << 10, kMetadataFront = 128 << 10, kNodesFront = 1;
/// What is asked for at a time of an index that is larger. What a server only claims to have never takes memory.
constexpr std::uint64_t kIndexStep = 8 << 20;

[[noreturn]] void refuse(const DecodeError& error, const std::filesystem::path& path,
                         std::uint64_t base = 0) {
  throw_input({.what = error.what,
               .path = path,
               .offset = base + error.byte_offset,
               .found = error.found,
               .expected = error.expected});
}

void append(std::vector<std::byte>& bytes, const ByteSource& file,
            const std::vector<ByteRange>& ranges) {
  for (const SharedBytes& part : file.read(ranges, {}))
    bytes.insert(bytes.end(), part->begin(), part->end());
}

/// Reads the pages that `bytes`, the beginning of an index of this layout, do not hold all of: each as a whole, as its checksum
/// is that of all of it.
void append_pages(std::vector<std::byte>& bytes, const ByteSource& file, const IndexLayout& layout,
                  const std::vector<std::uint64_t>& checksums) {
  const std::uint64_t page_bytes = layout.records_per_page * layout.record_size_bytes;
  std::uint64_t page = (bytes.size() - layout.pages_offset) / page_bytes;
  bytes.resize(static_cast<std::size_t>(layout.bytes_of(page).first));
  while (page < layout.page_count) {
    std::vector<ByteRange> ranges;
    const std::uint64_t begin = layout.bytes_of(page).first;
    for (; page < layout.page_count && layout.bytes_of(page).first - begin < kIndexStep; ++page) {
      const IndexRange all = layout.bytes_of(page);
      ranges.push_back({.offset = all.first, .size_bytes = all.count, .checksum = checksums[page]});
    }
    append(bytes, file, ranges);
  }
}

struct ReadIndex {
  DatasetIndex index;
  std::uint64_t root_checksum = 0;
};

std::optional<DecodeError> read_index(ByteSource& file, Fresh fresh, ReadIndex& read) {
  // The file's own size is compared with what its head claims before more is read.
  std::vector<std::byte> bytes = *file.front(kIndexFront, fresh);
  std::uint64_t prefix = 0;
  if (auto error = index_prefix_size(bytes, file.size_bytes(), prefix)) return error;
  while (bytes.size() < prefix)
    append(bytes, file,
           {{.offset = bytes.size(), .size_bytes = std::min(prefix - bytes.size(), kIndexStep)}});
  if (bytes.size() < file.size_bytes()) {
    std::vector<std::uint64_t> checksums;
    IndexHead head;
    if (auto error = parse_index_head(bytes, file.size_bytes(), head, checksums)) return error;
    append_pages(bytes, file, layout_of(head.dataset), checksums);
  }
  read.root_checksum = index_root_checksum(bytes);
  if (auto error = parse_index(bytes, read.index)) return error;
  file.keep_front(bytes);
  return std::nullopt;
}

ReadIndex read_index(ByteSource& file, Fresh fresh) {
  ReadIndex read;
  if (const auto error = read_index(file, fresh, read)) refuse(*error, file.path());
  return read;
}

std::string read_metadata(const ByteSource& file, const IndexHead& head) {
  const ByteRange all{
      .offset = 0, .size_bytes = head.metadata_size_bytes, .checksum = head.metadata_checksum};
  const SharedBytes bytes = all.size_bytes == 0 ? std::make_shared<const std::vector<std::byte>>()
                                                : file.read(std::span(&all, 1), {}).front();
  const std::uint64_t sum = checksum_of(*bytes);
  if (sum != head.metadata_checksum)
    throw_input({.what = "the checksum of the metadata does not match",
                 .path = file.path(),
                 .found = std::to_string(sum),
                 .expected = std::to_string(head.metadata_checksum)});
  std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (const auto error = check_metadata_text(text)) refuse(*error, file.path());
  return text;
}

struct ReadFiles {
  DatasetIndex index;
  std::string metadata;
};

/// Reads the index and the metadata, and sees whether the nodes are there. What is asked for may be under way already.
ReadFiles read_files(DatasetFiles& files, Fresh fresh, bool metadata_too) {
  auto [index, root_checksum] = read_index(*files.index, fresh);
  if (metadata_too) files.metadata->front(kMetadataFront, fresh);
  // The root checksum vouches for every byte of the dataset, so it names them.
  files.metadata->identify(root_checksum);
  files.metadata->expect_size(index.head.metadata_size_bytes);
  std::string metadata = read_metadata(*files.metadata, index.head);
  files.nodes->front(kNodesFront, fresh);
  files.nodes->identify(root_checksum);
  files.nodes->expect_size(index.head.nodes_size_bytes);
  return {std::move(index), std::move(metadata)};
}

}  // namespace

NodeWishes::NodeWishes(const DatasetReader& dataset, const SectionSet& wanted,
                       std::function<void()> arrived)
    : dataset_(dataset),
      wanted_(wanted),
      list_(dataset.files_.nodes->make_wish_list(std::move(arrived),
                                                 most_node_bytes(dataset, wanted))) {}

void NodeWishes::replace(std::span<const NodeId> nodes) {
  if (!dataset_.is_remote()) return;
  std::vector<ByteRange> ranges;
  for (const NodeId id : nodes) {
    const std::vector<ByteRange> sections = dataset_.ranges_of(id, wanted_);
    ranges.insert(ranges.end(), sections.begin(), sections.end());
  }
  list_->replace(ranges);
}

bool NodeWishes::ready(NodeId id) const {
  if (!dataset_.is_remote()) return true;
  return std::ranges::all_of(dataset_.ranges_of(id, wanted_), [&](const ByteRange& range) {
    return dataset_.files_.nodes->ready(range);
  });
}

DatasetReader DatasetReader::open(const Location& location, const AccessOptions& options) {
  DatasetFiles files = open_dataset_files(location, options);
  files.index->expect_front(kIndexFront);
  files.nodes->expect_front(kNodesFront);
  // With an index of an earlier run most likely the metadata is at hand, too.
  const bool all_at_once = files.index->is_remote() && !files.index->has_stored_front();
  if (all_at_once) files.metadata->expect_front(kMetadataFront);
  ReadFiles read;
  try {
    read = read_files(files, Fresh::kNo, all_at_once);
  } catch (const Error& error) {
    if (!files.index->is_remote() || error.kind() != ErrorKind::kInput) throw;
    // What a cache or the network has damaged, or kept of another version, comes right when it is asked for past all caches.
    read = read_files(files, Fresh::kYes, true);
  }
  return DatasetReader(std::move(files), std::move(read.index), std::move(read.metadata));
}

DatasetReader::DatasetReader(DatasetFiles files, DatasetIndex index, std::string metadata)
    : files_(std::move(files)),
      index_(std::move(index)),
      tree_(index_.head.dataset.tree()),
      metadata_(std::move(metadata)),
      index_size_bytes_(files_.index->size_bytes()) {}

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

std::vector<ByteRange> DatasetReader::ranges_of(NodeId id, const SectionSet& wanted) const {
  const NodeRecord& node = record(id);
  std::vector<ByteRange> ranges;
  for (std::size_t i = 0; i < node.sections.size(); ++i) {
    const SectionRef& section = node.sections[i];
    if (wanted[i] && section.size_bytes > 0)
      ranges.push_back({section.offset, section.size_bytes, section.checksum});
  }
  return ranges;
}

std::uint64_t DatasetReader::size_bytes(NodeId id, const SectionSet& wanted) const {
  std::uint64_t bytes = 0;
  for (const ByteRange& range : ranges_of(id, wanted)) bytes += range.size_bytes;
  return bytes;
}

std::unique_ptr<NodeWishes> DatasetReader::make_wishes(const SectionSet& wanted,
                                                       std::function<void()> arrived) const {
  return std::unique_ptr<NodeWishes>(new NodeWishes(*this, wanted, std::move(arrived)));
}

NodeData DatasetReader::read_node(NodeId id, const SectionSet& wanted,
                                  const std::stop_token& stop) const {
  const std::filesystem::path& path = files_.nodes->path();
  const NodeRecord& node = record(id);
  const std::vector<SharedBytes> read = files_.nodes->read(ranges_of(id, wanted), stop);
  std::vector<std::span<const std::byte>> bytes(node.sections.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const SectionRef& section = node.sections[i];
    if (!wanted[i] || section.size_bytes == 0) continue;
    bytes[i] = *read[next++];
    if (const std::uint64_t sum = checksum_of(bytes[i]); sum != section.checksum)
      throw_input({.what = "the checksum of section " + std::to_string(i) + " of node " +
                           std::to_string(value_of(id)) + " does not match",
                   .path = path,
                   .offset = section.offset,
                   .found = std::to_string(sum),
                   .expected = std::to_string(section.checksum)});
  }
  NodeData points;
  std::size_t failed = 0;
  if (const auto error =
          decode_node(header(), node, representatives_of(id), bytes, wanted, points, failed))
    refuse(*error, path, node.sections[failed].offset);
  return points;
}

}  // namespace cairn::formats
