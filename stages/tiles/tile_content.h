// From a node of the dataset to the points of a tile: positions as 16-bit codes in the node's own box, colours as linear
// light, and the attributes that nodes of all levels have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/tiles/linear_color.h"
#include "formats/tiles/tile_points.h"
#include "formats/tiles/tileset.h"

namespace cairn::stages {

/// The frame that all tiles share: metres = step_m * (grid position - origin), x and y as in the dataset, z up.
struct TileFrame {
  double metres_per_unit =
      1;  ///< of the axis whose unit is the longest: bounds lengths in any direction
  std::array<double, 3> unit_m{1, 1, 1};  ///< metres in a unit of each axis
  std::array<double, 3> step_m{1, 1, 1};  ///< metres a grid step
  formats::GridPoint origin{0, 0, 0};

  /// Exact up to the rounding of one product.
  double metres(std::size_t axis, std::int32_t position) const {
    return step_m[axis] * static_cast<double>(static_cast<std::int64_t>(position) - origin[axis]);
  }
};

/// The box of grid points, half a step wider on all sides, so that boxes contain their points whatever way clients round,
/// and one without extent has a volume.
formats::TileBox tile_box(const TileFrame& frame, const formats::GridBox& box);

/// A tile's points, and what rounding them to 16 bits did.
struct TileContent {
  formats::TilePoints points;
  double rounding_m = 0;  ///< no point is farther from its place in the dataset
  double spacing_m = 0;   ///< mean diameter of the splats
};

class TileContentMaker {
 public:
  /// `normals`: whether to write them, if the dataset has any. Reads the root's colours, to tell 8-bit colours in 16-bit
  /// fields.
  TileContentMaker(const formats::DatasetReader& dataset, const TileFrame& frame, bool normals,
                   formats::ColorClient color_client);

  /// Any number of threads at a time.
  TileContent make(formats::NodeId id) const;

  /// Attributes of the dataset that tiles do not have, by name: those that leaves alone carry and those of several
  /// components.
  const std::vector<std::string>& left_out() const { return left_out_; }

  /// Memory that one make() needs, what becomes of its result included.
  std::uint64_t working_bytes() const;

 private:
  void choose_columns(bool normals);
  unsigned bits_of_color() const;
  void add_positions(const formats::NodeData& node, TileContent& content) const;
  formats::TileColumn color_column(const formats::NodeData& node) const;
  formats::TileColumn normal_column(const formats::NodeData& node,
                                    const std::array<double, 3>& scale) const;
  formats::TileColumn property_column(const formats::NodeData& node, std::size_t attribute) const;

  const formats::DatasetReader& dataset_;
  TileFrame frame_;
  formats::SectionSet sections_;
  std::optional<std::size_t> color_, normal_;  ///< indices into the schema
  std::vector<std::size_t> properties_;
  std::vector<std::string> left_out_;
  std::optional<formats::LinearColors> linear_;  ///< if there are colours
};

}  // namespace cairn::stages
