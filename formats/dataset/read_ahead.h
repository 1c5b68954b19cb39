// For readers that know the order in which they will read nodes: of a dataset behind a network the next ones are on their way
// while one is worked on, so that the link is never idle. On a disk it does nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "formats/dataset/dataset_reader.h"

namespace cairn::formats {

class ReadAhead {
 public:
  /// What lies ahead at most: enough for most links, and several readers fit into what the access layer holds.
  static constexpr std::uint64_t kWindowBytes = 4 << 20;

  /// `order`: the nodes in the order in which they will be read with the sections `wanted`. `dataset` must outlive it.
  ReadAhead(const DatasetReader& dataset, const SectionSet& wanted, std::vector<NodeId> order);

  /// To be called before each node of the order is read.
  void next();

 private:
  const DatasetReader& dataset_;
  SectionSet wanted_;
  std::vector<NodeId> order_;
  std::size_t at_ = 0;  ///< of the order: the node that is read next
  std::unique_ptr<NodeWishes> wishes_;
};

}  // namespace cairn::formats
