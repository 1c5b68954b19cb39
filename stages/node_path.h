// A walk's decoded nodes, from the root down to where it stands, and for every point of them which point of each node
// above stands for it: so every leaf point can be compared with its representative on every level.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/read_ahead.h"

namespace cairn::stages {

/// The level on whose nodes walks begin that run side by side. It follows from the tree alone: what is found, sums of
/// doubles too, must not depend on the number of threads.
formats::Level level_of_subtrees(const formats::Tree& tree);

/// The nodes from the root to `node`, both included.
std::vector<formats::NodeId> nodes_down_to(const formats::Tree& tree, formats::NodeId node);

/// These, and then all below `node` in the order in which a walk meets them, parents first.
std::vector<formats::NodeId> nodes_of_walk(const formats::Tree& tree, formats::NodeId node);

/// No decoded point of the node is farther, in world units, than this from where it was before it was quantised.
double displacement_of(const formats::DatasetReader& dataset, formats::NodeId id);

class NodePath {
 public:
  /// `dataset` must outlive the path. Reads the sections `wanted`, and the representatives; of the nodes of a walk, entered
  /// in their order, the next ones are read ahead.
  NodePath(const formats::DatasetReader& dataset, const formats::SectionSet& wanted,
           std::vector<formats::NodeId> walk = {});

  /// Puts a node on its level; what is on the level above must be its parent. Throws as DatasetReader::read_node.
  void enter(formats::Level level, formats::NodeId id);

  formats::NodeId id(formats::Level level) const { return steps_[level].id; }
  const formats::NodeData& points(formats::Level level) const { return steps_[level].points; }
  /// For each point of the node on `level`, the point of the node on level `above` (above < level) that stands for it.
  const std::vector<std::uint32_t>& stands_for(formats::Level level, formats::Level above) const {
    return steps_[level].stands_for[above];
  }

 private:
  struct Step {
    formats::NodeId id{};
    formats::NodeData points;
    std::vector<std::vector<std::uint32_t>> stands_for;  ///< by level
  };

  const formats::DatasetReader& dataset_;
  formats::SectionSet wanted_;
  formats::ReadAhead ahead_;
  std::vector<Step> steps_;
};

}  // namespace cairn::stages
