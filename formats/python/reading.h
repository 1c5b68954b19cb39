// One call of Python that reads some nodes, in any number of threads: of a dataset on a server the next nodes are on their way
// meanwhile, and all of it can be stopped.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/read_ahead.h"

namespace cairn::formats::python {

/// What to read of nodes beside their positions.
struct Columns {
  std::vector<std::size_t> attributes;  ///< indices into the schema, in the order of the columns
  bool radius = false;
  bool weight = false;
  bool representative = false;

  /// Throws Error (kInvariant) for an attribute that the schema does not have.
  SectionSet sections(const DatasetHeader& header) const;
};

class Reading {
 public:
  /// `order`: the nodes in the order in which they will be read. Throws Error (kInvariant) for one that is not there.
  Reading(std::shared_ptr<const DatasetReader> dataset, std::vector<NodeId> order, Columns columns);

  bool is_remote() const { return dataset_->is_remote(); }

  /// Columns of the node at a place of the order, each an array of its own: steps, the attributes in the order asked for,
  /// radius, weight, representative. What is not asked for, or not there, is None. Called with the interpreter's lock,
  /// which is released meanwhile. Throws as DatasetReader::read_node does.
  pybind11::tuple node(std::size_t place);

  /// Ends what waits for a server; nothing more is asked of it. Without the interpreter's lock.
  void stop();

 private:
  NodeData read(NodeId id);
  pybind11::tuple arrays(NodeData data) const;

  const std::shared_ptr<const DatasetReader> dataset_;
  const std::vector<NodeId> order_;
  const Columns columns_;
  const SectionSet wanted_;
  std::stop_source stop_;
  std::mutex mutex_;  ///< of the next
  std::optional<ReadAhead> ahead_;
};

}  // namespace cairn::formats::python
