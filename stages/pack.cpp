#include "stages/pack.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/index_file.h"
#include "formats/dataset/node_codec.h"
#include "formats/dataset/node_frame.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/normal_cone.h"
#include "formats/dataset/record_codec.h"
#include "formats/error.h"

namespace cairn::stages {
namespace {

using formats::NodeData;
using formats::Normal;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The smallest float that is not less than `x`; infinite beyond the range.
float rounded_up(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) < x ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) > x ? std::nextafter(f, -std::numeric_limits<float>::infinity())
                                    : f;
}

double length_of(const std::array<double, 3>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/// The cone around the mean of a node's decoded normals. Points without a normal do not count; with no
/// normal, or normals that cancel, the axis is zero and the cone everything.
formats::NormalCone cone_of(const formats::Schema& schema, const NodeData& decoded) {
  const auto attribute = formats::normal_attribute(schema);
  if (!attribute || decoded.attributes[*attribute].empty()) return {};
  const auto& column = decoded.attributes[*attribute];
  const formats::ScalarType type = schema[*attribute].type;
  std::array<double, 3> sum{0, 0, 0};
  for (std::size_t i = 0; i < decoded.count(); ++i) {
    const Normal n = formats::normal_at(column, type, i);
    for (std::size_t a = 0; a < 3; ++a) sum[a] += static_cast<double>(n[a]);
  }
  const double length = length_of(sum);
  if (!(length > 1e-6) || !std::isfinite(length)) return {};
  formats::NormalCone cone;
  for (std::size_t a = 0; a < 3; ++a) cone.axis[a] = static_cast<float>(sum[a] / length);
  double least = 1;
  for (std::size_t i = 0; i < decoded.count(); ++i)
    if (const auto cosine = formats::cone_cosine(cone, formats::normal_at(column, type, i)))
      least = std::min(least, *cosine);
  cone.min_cosine = std::max(-1.0f, rounded_down(least));
  return cone;
}

/// A factor, rounded up, by which the decoded radii cover what the points stand for;
/// infinite where a point without extent stands for something that has one.
float cover_factor_of(const std::vector<double>& reach, const NodeData& decoded,
                      double displacement_bound) {
  if (reach.empty()) return 1;
  double factor = 0;
  for (std::size_t i = 0; i < reach.size(); ++i) {
    const double needed = reach[i] + displacement_bound;
    const double radius = static_cast<double>(decoded.radius[i]);
    if (needed > 0) factor = std::max(factor, radius > 0 ? needed / radius : kInfinity);
  }
  return rounded_up(factor);
}

void require_within_bounds(formats::NodeId id, const formats::QuantizationErrors& errors) {
  const auto require = [&](const char* what, const formats::QuantizationError& error) {
    if (error.largest <= error.bound) return;
    throw formats::Error(
        formats::ErrorKind::kInvariant,
        {.what = std::string(what) + " of node " + std::to_string(formats::value_of(id)) +
                 " are stored less exactly than promised",
         .found = std::to_string(error.largest),
         .expected = std::to_string(error.bound) + " at most"});
  };
  require("positions", errors.position);
  require("radii", errors.radius);
  require("normals", errors.normal);
}

}  // namespace

formats::NodeRecord describe_node(const formats::DatasetHeader& header, const ClusteredNode& node,
                                  const NodeData& decoded, double displacement_bound) {
  CAIRN_CHECK(node.reach.empty() || node.reach.size() == decoded.count());
  formats::NodeRecord record;
  record.id = node.id;
  record.box = node.subtree_box;
  record.box.add(formats::box_of(decoded.position));
  record.weight = node.weight;
  record.block_start = node.block_start;
  record.cover_factor = cover_factor_of(node.reach, decoded, displacement_bound);
  record.rms = std::sqrt(node.squared_error / static_cast<double>(node.weight));
  record.bound = node.bound + displacement_bound;
  if (node.bound > 0 && displacement_bound > 0)
    record.bound = std::nextafter(record.bound, kInfinity);
  record.theta = node.theta;
  record.grid = node.grid;
  record.cone = cone_of(header.schema, decoded);
  record.digest = node.digest;
  return record;
}

Packer::Packer(const formats::DatasetHeader& header, formats::Codec codec,
               formats::OutputFile& spill)
    : header_(header), tree_(header.tree()), codec_(codec), spill_(spill) {
  formats::check_limits(header);
  nodes_.resize(tree_.node_count());
}

void Packer::take(ClusteredNode&& node) {
  const bool leaf = tree_.is_leaf(node.id);
  const auto frame = formats::NodeFrame::fit(header_, leaf, node.points);
  formats::NodeRecord encoded;
  encoded.id = node.id;
  const std::vector<std::byte> bytes =
      formats::encode_node(node.points, header_, leaf, codec_, encoded);
  PackedNode packed;
  packed.numerics = node.numerics;
  // The original is not needed any more.
  packed.numerics.quantization = frame.quantize(header_.schema, header_.grid, node.points);
  require_within_bounds(node.id, packed.numerics.quantization);
  packed.record = describe_node(header_, node, node.points, frame.displacement_bound(header_.grid));
  packed.record.point_count = encoded.point_count;
  packed.record.position_bits = encoded.position_bits;
  packed.record.position_box = encoded.position_box;
  packed.record.radius_min = encoded.radius_min;
  packed.record.radius_max = encoded.radius_max;
  packed.record.sections = std::move(encoded.sections);
  packed.size_bytes = bytes.size();
  packed.spill_offset = spill_.append(bytes);
  store(std::move(packed));
}

void Packer::save(formats::NodeId subtree, StateWriter& state) const {
  std::vector<std::byte> record(formats::record_size_bytes(header_));
  for (const formats::NodeId id : tree_.subtree(subtree)) {
    const PackedNode& node = nodes_[formats::value_of(id)];
    formats::encode_record(header_, tree_, node.record, record);
    state.put(record).put(node.spill_offset).put(node.size_bytes).put(node.numerics);
  }
}

bool Packer::restore(formats::NodeId subtree, StateReader& state) {
  std::vector<PackedNode> restored;
  std::vector<std::byte> record;
  for (const formats::NodeId id : tree_.subtree(subtree)) {
    PackedNode& node = restored.emplace_back();
    state.get(record);
    state.get(node.spill_offset);
    state.get(node.size_bytes);
    state.get(node.numerics);
    if (formats::decode_record(header_, tree_, id, node.size_bytes, record, node.record) ||
        !is_spilled(node))
      return false;
  }
  for (PackedNode& node : restored) store(std::move(node));
  return true;
}

bool Packer::is_spilled(const PackedNode& node) const {
  if (node.spill_offset > spill_.size_bytes() ||
      node.size_bytes > spill_.size_bytes() - node.spill_offset)
    return false;
  std::vector<std::byte> bytes(node.size_bytes);
  spill_.read_at(node.spill_offset, bytes);
  return std::ranges::all_of(node.record.sections, [&](const formats::SectionRef& section) {
    return formats::checksum_of(std::span(bytes).subspan(section.offset, section.size_bytes)) ==
               section.checksum ||
           section.size_bytes == 0;
  });
}

void Packer::store(PackedNode node) {
  const std::uint64_t id = formats::value_of(node.record.id);
  CAIRN_CHECK(id < nodes_.size() && nodes_[id].size_bytes == 0 && node.size_bytes > 0);
  nodes_[id] = std::move(node);
}

std::vector<PackedNode> Packer::finish() {
  for (std::uint64_t id = 0; id < nodes_.size(); ++id)
    if (nodes_[id].size_bytes == 0)
      throw formats::Error(formats::ErrorKind::kInvariant,
                           {.what = "node " + std::to_string(id) + " was never packed"});
  return std::exchange(nodes_, {});
}

}  // namespace cairn::stages
