// Index: brings the packed nodes into their final order and writes the three files of a dataset.
// Nodes lie coarse to fine, on a level along the Hilbert curve of their boxes' centres, so that a
// reader that refines a view reads long runs; ties are settled by id.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/dataset/metadata.h"
#include "formats/output_file.h"
#include "stages/context.h"
#include "stages/packed_node.h"

namespace cairn::stages {

/// The files to be filled, empty and open.
struct DatasetFiles {
  formats::OutputFile& nodes;
  formats::OutputFile& index;
  formats::OutputFile& metadata;
};

struct IndexReport {
  std::uint64_t nodes = 0;
  std::uint64_t nodes_size_bytes = 0;
  std::uint64_t index_size_bytes = 0;
  std::uint64_t metadata_size_bytes = 0;
  double bound = 0;  ///< world units, of the root
  double rms = 0;    ///< world units, of the root
};

/// The order of the nodes in nodes.bin, as indices into `nodes` (all nodes, in id order).
std::vector<std::uint64_t> storage_order(const formats::Tree& tree,
                                         const std::vector<PackedNode>& nodes);

/// Copies the nodes from the spill, verifying their checksums, and writes index and metadata; makes all
/// three files durable. `nodes` are all nodes in id order; their numerics become those of the extras' levels. Throws Error: kSystem where the disk refuses,
/// kInvariant where the spill is not what was packed.
IndexReport write_dataset(const Context& context, const formats::DatasetHeader& header,
                          std::vector<PackedNode> nodes, const formats::OutputFile& spill,
                          formats::MetadataExtras extras, DatasetFiles files);

}  // namespace cairn::stages
