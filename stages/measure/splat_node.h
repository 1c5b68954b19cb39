// The splats of a node, made ready for searches by distance and by cover.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/normal_map.h"
#include "stages/measure/position_index.h"

namespace cairn::stages {

struct Splat {
  formats::GridPoint position{};
  float radius = 0;          ///< world units
  formats::Normal normal{};  ///< of any length; zero: none
};

/// A node's splats in classes of like radii, by factors of two from the widest down, so that a search for those that
/// reach a place need not look as far for all as the widest one reaches. Splats at one position are one site.
class SplatNode {
 public:
  struct Site {
    Splat widest;                ///< of those at the position the one with the largest radius
    std::uint32_t first_radius;  ///< of all of them, in RadiusClass::radii
    std::uint32_t end_radius;
  };
  struct RadiusClass {
    double widest = 0;         ///< no splat of the class has a larger radius
    std::vector<Site> sites;   ///< numbered as the index has them
    std::vector<float> radii;  ///< of a site's splats one after the other, the largest first
    std::unique_ptr<PositionIndex> index;
  };

  /// Reads a node. Throws as DatasetReader::read_node.
  SplatNode(const formats::DatasetReader& dataset, formats::NodeId id);

  /// None is empty; that with the most sites comes first.
  const std::vector<RadiusClass>& classes() const { return classes_; }

  /// Memory of a node's splats, a point.
  static constexpr std::uint64_t kBytesPerSplat =
      sizeof(Site) + sizeof(float) + PositionIndex::kBytesPerPosition;

 private:
  std::vector<RadiusClass> classes_;
};

}  // namespace cairn::stages
