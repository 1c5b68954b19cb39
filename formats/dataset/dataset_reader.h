// A dataset opened for reading: the index in memory, node sections on demand. All that an outside
// program needs; every byte is checked against its checksum before it is decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/dataset/index_file.h"
#include "formats/dataset/node_codec.h"
#include "formats/dataset/node_data.h"
#include "formats/dataset/tree.h"
#include "formats/random_access_file.h"

namespace cairn::formats {

/// The files of a dataset directory.
namespace dataset_file {
inline constexpr const char* kIndex = "index.bin";
inline constexpr const char* kNodes = "nodes.bin";
inline constexpr const char* kMetadata = "metadata.json";
}  // namespace dataset_file

class DatasetReader {
 public:
  /// Opens the dataset in `directory` and reads its index and metadata. Throws Error: kInput for damaged
  /// or contradictory files, kSystem for those that cannot be opened or read.
  static DatasetReader open(const std::filesystem::path& directory);

  const DatasetHeader& header() const { return index_.head.dataset; }
  const IndexHead& head() const { return index_.head; }
  const Tree& tree() const { return tree_; }
  /// All records, in id order.
  const std::vector<NodeRecord>& nodes() const { return index_.nodes; }
  /// Requires an id below tree().node_count().
  const NodeRecord& record(NodeId id) const;
  const std::string& metadata() const { return metadata_; }
  std::uint64_t index_size_bytes() const { return index_size_bytes_; }

  /// Reads and decodes the wanted sections of a node. Any number of threads at a time. Throws Error:
  /// kInput for sections that are damaged, kSystem where reading fails.
  NodeData read_node(NodeId id, const SectionSet& wanted) const;

 private:
  DatasetReader(RandomAccessFile nodes, DatasetIndex index, std::string metadata,
                std::uint64_t index_size_bytes);
  IndexRange representatives_of(NodeId id) const;

  RandomAccessFile nodes_file_;
  DatasetIndex index_;
  Tree tree_;
  std::string metadata_;
  std::uint64_t index_size_bytes_;
};

}  // namespace cairn::formats
