// A dataset opened for reading, on a disk or behind a network: the index in memory, node sections on demand. All that
// an outside program needs; every byte is checked against its checksum before it is decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "formats/access/dataset_files.h"
#include "formats/dataset/index_file.h"
#include "formats/dataset/node_codec.h"
#include "formats/dataset/node_data.h"
#include "formats/dataset/tree.h"

namespace cairn::formats {

class DatasetReader;

/// What one reader of nodes will want: of a dataset behind a network it is fetched before it is asked for.
class NodeWishes {
 public:
  /// The most urgent first, in the place of all earlier wishes that are not under way.
  void replace(std::span<const NodeId> nodes);
  /// Whether reading the node would not wait for a network; it may fail, though.
  bool ready(NodeId id) const;

 private:
  friend class DatasetReader;
  NodeWishes(const DatasetReader& dataset, const SectionSet& wanted, std::function<void()> arrived);

  const DatasetReader& dataset_;
  SectionSet wanted_;
  std::unique_ptr<WishList> list_;
};

class DatasetReader {
 public:
  /// Opens the dataset in a directory or at an address and reads its index and metadata. Throws Error: kInput for
  /// damaged or contradictory files, kSystem for those that cannot be opened or read, kUsage for an address that
  /// cannot be one; and Stopped.
  static DatasetReader open(const Location& location, const AccessOptions& options = {});

  const DatasetHeader& header() const { return index_.head.dataset; }
  const IndexHead& head() const { return index_.head; }
  const Tree& tree() const { return tree_; }
  /// All records, in id order.
  const std::vector<NodeRecord>& nodes() const { return index_.nodes; }
  /// Requires an id below tree().node_count().
  const NodeRecord& record(NodeId id) const;
  const std::string& metadata() const { return metadata_; }
  std::uint64_t index_size_bytes() const { return index_size_bytes_; }
  bool is_remote() const { return files_.nodes->is_remote(); }
  /// What was fetched so far.
  AccessStatistics access() const { return files_.statistics(); }

  /// Reads and decodes the wanted sections of a node. Any number of threads at a time. Throws Error:
  /// kInput for sections that are damaged, kSystem where reading fails; and Stopped, where it waits for a network
  /// and `stop` is requested. That ends this call alone.
  NodeData read_node(NodeId id, const SectionSet& wanted, const std::stop_token& stop = {}) const;

  /// A list of nodes to come, to be read with these sections. `arrived` is called by another thread when a node may
  /// have become ready; it must not change the list. The reader must outlive the list.
  std::unique_ptr<NodeWishes> make_wishes(const SectionSet& wanted,
                                          std::function<void()> arrived = {}) const;
  /// The bytes of the wanted sections of a node.
  std::uint64_t size_bytes(NodeId id, const SectionSet& wanted) const;

 private:
  friend class NodeWishes;
  DatasetReader(DatasetFiles files, DatasetIndex index, std::string metadata);
  IndexRange representatives_of(NodeId id) const;
  /// Where the wanted sections that the node has lie.
  std::vector<ByteRange> ranges_of(NodeId id, const SectionSet& wanted) const;

  DatasetFiles files_;
  DatasetIndex index_;
  Tree tree_;
  std::string metadata_;
  std::uint64_t index_size_bytes_;
};

}  // namespace cairn::formats
