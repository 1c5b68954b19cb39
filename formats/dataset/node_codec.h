// A node's points to and from the sections of nodes.bin: quantised, filtered, compressed, each section
// by itself. The encodings are told in formats/FORMAT.md, "Sections".
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/dataset/codec.h"
#include "formats/dataset/node_data.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/record_codec.h"
#include "formats/error.h"

namespace cairn::formats {

/// Which sections of a node are wanted, by SectionIndex.
using SectionSet = std::bitset<kMaxSections>;
inline SectionSet all_sections() { return SectionSet().set(); }

/// How the points of one node are stored, and what that does to them.
class NodeFrame {
 public:
  /// Fits the frame to a node's points before quantisation. Requires at least one point and finite
  /// radii >= 0, one a point.
  static NodeFrame fit(const DatasetHeader& header, bool leaf, const NodeData& points);
  /// The frame that a record tells of.
  static NodeFrame of(const DatasetHeader& header, bool leaf, const NodeRecord& record);

  std::uint8_t position_bits() const { return position_bits_; }
  const GridBox& position_box() const { return position_box_; }
  float radius_min() const { return radius_min_; }
  float radius_max() const { return radius_max_; }
  /// Positions come back as they were.
  bool positions_exact() const;
  /// Normals are stored in the input's own type.
  bool normals_exact() const { return normals_exact_; }
  /// Radii are stored as float32.
  bool radii_exact() const { return radii_exact_; }
  /// No decoded point is farther than this from the original: world units, rounded up; 0 if exact.
  double displacement_bound(const Grid& grid) const;

 private:
  std::uint8_t position_bits_ = 16;
  GridBox position_box_;
  float radius_min_ = 0;
  float radius_max_ = 0;
  bool normals_exact_ = false;
  bool radii_exact_ = false;
};

/// Replaces positions, radii and normals by what a reader of the dataset will see of them.
void quantize_node(const DatasetHeader& header, bool leaf, NodeData& points);

/// Encodes a node. Fills position_bits, position_box, radius_min, radius_max, point_count and sections
/// (offsets count from the start of the result) of `record`; the rest is left alone. Requires columns
/// of the right sizes, non-decreasing representatives (kInvariant otherwise), and at most kMaxNodePoints
/// points (kUsage otherwise).
std::vector<std::byte> encode_node(const NodeData& points, const DatasetHeader& header, bool leaf,
                                   Codec codec, NodeRecord& record);

/// The bytes of a node's sections; those not wanted may be empty.
using SectionBytes = std::span<const std::span<const std::byte>>;

/// Decodes the wanted sections of a node; columns that are absent or not wanted stay empty.
/// `representatives` are the points of the parent's block for this node (count 0 for the root).
/// Requires header.schema and record as checked by decode_record, and bytes.size() == section_count.
/// Bytes of any content are refused, never trusted. `byte_offset` of an error counts from the start
/// of the section in `failed_section`.
[[nodiscard]] std::optional<DecodeError> decode_node(const DatasetHeader& header, const NodeRecord& record,
                                                     IndexRange representatives, SectionBytes bytes,
                                                     const SectionSet& wanted, NodeData& points,
                                                     std::size_t& failed_section);

}  // namespace cairn::formats
