// Pack: a clustered node becomes its record and the bytes of its sections.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point
// Models Using Multi-way kd-Trees", 2010, section III.C. Where it departs: what quantisation does to a
// node is added to the error bound and to the cover factor, so that both hold for the decoded points.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/dataset/codec.h"
#include "formats/dataset/node_record.h"
#include "formats/output_file.h"
#include "stages/clustered_node.h"
#include "stages/packed_node.h"

namespace cairn::stages {

/// Takes nodes from any number of threads, in any order. Records and section bytes depend on the nodes
/// alone; only where a node lies in the spill depends on the order of calls, and index forgets that.
class Packer final : public NodeSink {
 public:
  /// `spill` must outlive the packer. Requires a header with points, fan-out and target already set.
  Packer(const formats::DatasetHeader& header, formats::Codec codec, formats::OutputFile& spill);

  /// Encodes a node and appends it to the spill. Throws Error: kSystem where the disk refuses,
  /// kInvariant for a node that comes twice or whose columns do not fit.
  void take(ClusteredNode&& node) override;

  void save(formats::NodeId subtree, StateWriter& state) const override;
  /// Requires the spill of the run that saved the state. False if the bytes in it are not those of that time.
  bool restore(formats::NodeId subtree, StateReader& state) override;

  /// All nodes in id order, once every node has been taken (kInvariant otherwise). The packer is empty
  /// afterwards.
  std::vector<PackedNode> finish();

 private:
  void store(PackedNode node);
  bool is_spilled(const PackedNode& node) const;

  const formats::DatasetHeader header_;
  const formats::Tree tree_;
  const formats::Codec codec_;
  formats::OutputFile& spill_;
  std::vector<PackedNode> nodes_;  ///< by id; each entry is written by one thread alone
};

/// The record of a node as its decoded points will show it, without sections: cone, cover factor,
/// bound, RMS and box. `decoded` are the node's points after quantisation.
formats::NodeRecord describe_node(const formats::DatasetHeader& header, const ClusteredNode& node,
                                  const formats::NodeData& decoded, double displacement_bound);

}  // namespace cairn::stages
