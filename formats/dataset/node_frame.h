// How the points of one node are stored, and what that does to them: the widths and extremes that its
// sections are encoded with, and what a reader will see of a point.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "formats/dataset/node_data.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/numerics.h"

namespace cairn::formats {

/// The attribute that is stored as a direction: the first with the rule kNormal, if there is one.
std::optional<std::size_t> normal_attribute(const Schema& schema);

class NodeFrame {
 public:
  /// Fits the frame to a node's points before quantisation. Requires at least one point and finite
  /// radii >= 0, one a point (an Error of kind kInvariant otherwise).
  static NodeFrame fit(const DatasetHeader& header, bool leaf, const NodeData& points);
  /// The frame that a record tells of.
  static NodeFrame of(const DatasetHeader& header, bool leaf, const NodeRecord& record);

  std::uint8_t position_bits() const { return position_bits_; }
  const GridBox& position_box() const { return position_box_; }
  float radius_min() const { return radius_min_; }
  float radius_max() const { return radius_max_; }
  /// Positions come back as they were.
  bool positions_exact() const;
  /// Normals are stored in the input's own type; estimated ones never are.
  bool normals_exact() const { return normals_exact_; }
  /// Radii are stored as float32.
  bool radii_exact() const { return radii_exact_; }
  /// No decoded point is farther than this from the original: world units, rounded up; 0 if exact.
  double displacement_bound(const Grid& grid) const;

  /// What a reader will see of radii, none outside of radius_min() to radius_max().
  std::vector<float> quantized_radii(std::vector<float> radii) const;
  /// Replaces positions, radii and normals by what a reader of the dataset will see of them, and tells how far off that
  /// is. Requires the points that the frame was fitted to; columns that are empty stay so.
  QuantizationErrors quantize(const Schema& schema, const Grid& grid, NodeData& points) const;

 private:
  NodeFrame(const DatasetHeader& header, bool leaf);
  QuantizationError quantize_positions(const Grid& grid, std::vector<GridPoint>& positions) const;
  QuantizationError quantize_radii(std::vector<float>& radii) const;

  std::uint8_t position_bits_;
  GridBox position_box_;
  float radius_min_ = 0;
  float radius_max_ = 0;
  bool normals_exact_;
  bool radii_exact_;
};

}  // namespace cairn::formats
