// What the index says of a node, in memory. Its bytes are told in formats/FORMAT.md and written by
// formats/dataset/index_file.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/dataset/grid.h"
#include "formats/dataset/tree.h"
#include "formats/schema.h"

namespace cairn::formats {

/// An order-free digest of input records: the sum modulo 2^128 of the XXH3 128-bit hashes of the
/// records (grid position and all kept attributes, as laid out by RecordLayout with 12-byte positions).
/// Sums of disjoint sets add up, so a parent's digest is the sum of its children's.
struct Digest {
  std::uint64_t low = 0;
  std::uint64_t high = 0;

  Digest& operator+=(const Digest& other) {
    low += other.low;
    high += other.high + (low < other.low ? 1 : 0);
    return *this;
  }
  friend bool operator==(const Digest&, const Digest&) = default;
};

/// Where a section lies in nodes.bin. Absent sections have size 0.
struct SectionRef {
  std::uint64_t offset = 0;
  std::uint32_t size_bytes = 0;
  std::uint64_t checksum = 0;  ///< XXH3 64-bit of the section's bytes
  friend bool operator==(const SectionRef&, const SectionRef&) = default;
};

/// The sections of a node, in this order: the fixed ones, then one an attribute of the schema.
enum SectionIndex : std::size_t {
  kPositionSection = 0,
  kRepresentativeSection = 1,  ///< absent in the root
  kWeightSection = 2,          ///< absent in leaves, where every weight is 1
  kRadiusSection = 3,
  kFirstAttributeSection = 4,
};

struct NormalCone {
  std::array<float, 3> axis{0, 0, 0};  ///< unit, or zero if there is no normal
  float min_cosine = -1;  ///< smallest cosine between the axis and a normal of the node
  friend bool operator==(const NormalCone&, const NormalCone&) = default;
};

struct NodeRecord {
  NodeId id{};
  GridBox box;                    ///< tight box of the node's decoded points and of all below it
  std::uint32_t point_count = 0;  ///< points stored in this node
  std::uint64_t weight = 0;       ///< input points that they stand for
  /// N + 1 entries: block i of an inner node, one a child, is [block_start[i], block_start[i+1]). A
  /// leaf is one block: 0, count, count, ...
  std::vector<std::uint32_t> block_start;
  std::uint8_t position_bits = 16;  ///< bits a coordinate of the position section
  GridBox
      position_box;  ///< tight box of the node's points before quantisation: the quantiser's frame
  float radius_min = 0;  ///< world units: extremes of the node's splat radii
  float radius_max = 0;
  /// By this factor the decoded radii, as spheres, cover the spheres that they stand for; 1 in leaves. The smallest
  /// that is certain before the points below are decoded: a little more than the decoded points need.
  float cover_factor = 1;
  double rms =
      0;  ///< world units: RMS distance of input points to their representative in this node
  double bound = 0;  ///< world units: no input point is farther from its representative, decoded
  float theta = 0;   ///< degrees: largest normal deviation that merging in this node was relaxed to
  std::uint32_t grid = 0;  ///< cells along the longest axis of the coarsest clustering grid used
  NormalCone cone;
  Digest digest;                     ///< of the subtree's input records
  std::vector<SectionRef> sections;  ///< kFirstAttributeSection + schema.size() entries

  friend bool operator==(const NodeRecord&, const NodeRecord&) = default;
};

/// Whether refining a node replaces it by its children or adds them to it.
enum class Refinement : std::uint8_t { kReplace = 0, kAdd = 1 };

/// Where the radii of the leaves' points come from.
enum class RadiusOrigin : std::uint8_t {
  kDensity = 0,    ///< estimated from the local density while clustering
  kInput = 1,      ///< brought by the input
  kNeighbors = 2,  ///< estimated from the nearest neighbours
};

/// What all nodes of a dataset share; the head of index.bin.
struct DatasetHeader {
  Grid grid;
  std::uint64_t points = 0;  ///< kept input points
  std::uint32_t fanout = 0;
  std::uint64_t target_points = 0;
  Refinement refinement = Refinement::kReplace;
  /// The attributes, radius left out: the input's, then those that were estimated. Those with a rule other than
  /// kNone exist in inner nodes too.
  Schema schema;
  RadiusOrigin radius_origin = RadiusOrigin::kDensity;
  bool lossless_leaves = false;  ///< leaf positions, normals and radii are the input's, bit by bit
  std::uint8_t position_bits = 16;   ///< of inner nodes, and of leaves that are not lossless
  std::uint64_t read_points = 0;     ///< records met in the input
  std::uint64_t dropped_points = 0;  ///< of these left out: not finite, or no point
  std::uint64_t missing_points = 0;  ///< claimed by headers but absent from the files

  Tree tree() const { return Tree(points, fanout, target_points); }
  friend bool operator==(const DatasetHeader&, const DatasetHeader&) = default;
};

}  // namespace cairn::formats
