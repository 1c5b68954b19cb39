#include "formats/dataset/record_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "formats/bytes.h"
#include "formats/dataset/field_reader.h"

namespace cairn::formats {
namespace {

std::size_t blocks_size_bytes(const DatasetHeader& header) {
  const std::size_t size = sizeof(std::uint32_t) * (std::size_t{header.fanout} + 1);
  return (size + 7) / 8 * 8;
}

void write_box(ByteWriter& to, const GridBox& box) {
  for (const std::int32_t c : box.min) to.write(c);
  for (const std::int32_t c : box.max) to.write(c);
}

std::uint64_t parent_field(const Tree& tree, NodeId id) {
  return value_of(id) == 0 ? kNoNode : value_of(tree.parent(id));
}

std::uint64_t first_child_field(const Tree& tree, NodeId id, bool leaf) {
  return leaf ? kNoNode : value_of(tree.first_child(id));
}

void read_links(FieldReader& in, const DatasetHeader& header, const Tree& tree, NodeId id,
                bool leaf) {
  in.get_equal<std::uint64_t>("wrong node id", value_of(id));
  in.get_equal<std::uint64_t>("wrong parent", parent_field(tree, id));
  in.get_equal<std::uint64_t>("wrong first child", first_child_field(tree, id, leaf));
  in.get_equal<std::uint32_t>("wrong number of children", leaf ? 0 : header.fanout);
  in.get_equal<std::uint32_t>("wrong level", tree.level_of(id));
}

void read_points(FieldReader& in, const DatasetHeader& header, const Tree& tree, bool leaf,
                 NodeRecord& record) {
  record.box = in.get_box("bad box");
  const auto most = static_cast<std::uint32_t>(std::min(header.points, tree.node_points()));
  record.point_count = in.get_in<std::uint32_t>("impossible number of points", 1, most);
  if (leaf)
    in.require(record.point_count == tree.stored_points(record.id),
               "wrong number of points in a leaf", record.point_count,
               std::to_string(tree.stored_points(record.id)));
  record.position_bits = in.get<std::uint8_t>();
  const std::uint8_t bits = leaf && header.lossless_leaves ? 32 : header.position_bits;
  in.require(record.position_bits == bits, "wrong position bits", record.position_bits,
             std::to_string(bits));
  for (int i = 0; i < 3; ++i) in.get_equal<std::uint8_t>("padding is not zero", 0);
  record.position_box = in.get_box("bad position box");
  record.weight = in.get<std::uint64_t>();
  in.require(record.weight >= record.point_count && record.weight <= header.points,
             "impossible weight", record.weight,
             std::to_string(record.point_count) + " to " + std::to_string(header.points));
}

void read_measures(FieldReader& in, NodeRecord& record) {
  constexpr float kMaxFloat = std::numeric_limits<float>::max();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  record.radius_min = in.get_in<float>("bad smallest radius", 0, kMaxFloat);
  record.radius_max = in.get_in<float>("bad largest radius", record.radius_min, kMaxFloat);
  record.cover_factor = in.get_in<float>("bad cover factor", 0, kInfinity);
  record.theta = in.get_in<float>("bad angle", 0, 180);
  record.rms = in.get_in<double>("bad RMS error", 0, std::numeric_limits<double>::max());
  record.bound = in.get_in<double>("bad error bound", 0, std::numeric_limits<double>::max());
  record.grid = in.get<std::uint32_t>();
  double length2 = 0;
  for (float& c : record.cone.axis) {
    c = in.get_in<float>("bad normal cone axis", -1, 1);
    length2 += static_cast<double>(c) * c;
  }
  in.require(length2 == 0 || std::abs(length2 - 1) < 1e-5, "normal cone axis is not a unit vector",
             length2, "length 0 or 1");
  record.cone.min_cosine = in.get_in<float>("bad normal cone", -1, 1);
  in.get_equal<std::uint32_t>("padding is not zero", 0);
  record.digest.low = in.get<std::uint64_t>();
  record.digest.high = in.get<std::uint64_t>();
}

void read_blocks(FieldReader& in, const DatasetHeader& header, bool leaf, NodeRecord& record) {
  const std::size_t end = in.position() + blocks_size_bytes(header);
  record.block_start.resize(std::size_t{header.fanout} + 1);
  std::uint32_t previous = 0;
  for (std::size_t i = 0; i < record.block_start.size(); ++i) {
    const bool closed = i == header.fanout || (leaf && i > 0);
    const std::uint32_t low = i == 0 ? 0 : closed ? record.point_count : previous;
    const std::uint32_t high = i == 0 ? 0 : record.point_count;
    previous = record.block_start[i] = in.get_in<std::uint32_t>("bad block start", low, high);
  }
  if (in.position() < end) in.get_equal<std::uint32_t>("padding is not zero", 0);
}

void read_sections(FieldReader& in, const DatasetHeader& header, bool leaf,
                   std::uint64_t nodes_size_bytes, NodeRecord& record) {
  record.sections.resize(section_count(header));
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < record.sections.size(); ++i) {
    SectionRef& section = record.sections[i];
    const bool present = has_section(header, i, value_of(record.id) == 0, leaf);
    section.offset = in.get<std::uint64_t>();
    if (i == 0) end = section.offset;
    in.require(section.offset == (present ? end : 0), "section out of place", section.offset,
               std::to_string(present ? end : 0));
    section.size_bytes = in.get<std::uint32_t>();
    in.require((section.size_bytes != 0) == present,
               present ? "section missing" : "unexpected section", section.size_bytes,
               present ? "a size" : "0");
    const bool fits = section.offset <= nodes_size_bytes &&
                      section.size_bytes <= nodes_size_bytes - section.offset;
    in.require(fits, "section reaches beyond the end of the nodes", section.offset,
               "within " + std::to_string(nodes_size_bytes) + " bytes");
    if (fits && present) end = section.offset + section.size_bytes;
    in.get_equal<std::uint32_t>("padding is not zero", 0);
    section.checksum = in.get<std::uint64_t>();
    in.require(present || section.checksum == 0, "checksum of an absent section", section.checksum,
               "0");
  }
}

}  // namespace

std::size_t section_count(const DatasetHeader& header) {
  return kFirstAttributeSection + header.schema.size();
}

bool has_section(const DatasetHeader& header, std::size_t section, bool root, bool leaf) {
  if (section == kRepresentativeSection) return !root;
  if (section == kWeightSection) return !leaf;
  if (section < kFirstAttributeSection || leaf) return true;
  return header.schema[section - kFirstAttributeSection].rule != ReduceRule::kNone;
}

std::size_t record_size_bytes(const DatasetHeader& header) {
  return kRecordFixedBytes + blocks_size_bytes(header) + kSectionRefBytes * section_count(header);
}

void encode_record(const DatasetHeader& header, const Tree& tree, const NodeRecord& record,
                   std::span<std::byte> out) {
  CAIRN_CHECK(out.size() == record_size_bytes(header));
  CAIRN_CHECK(record.block_start.size() == std::size_t{header.fanout} + 1);
  CAIRN_CHECK(record.sections.size() == section_count(header));
  const bool leaf = tree.is_leaf(record.id);
  ByteWriter to;
  to.write(value_of(record.id));
  to.write(parent_field(tree, record.id));
  to.write(first_child_field(tree, record.id, leaf));
  to.write<std::uint32_t>(leaf ? 0 : header.fanout);
  to.write<std::uint32_t>(tree.level_of(record.id));
  write_box(to, record.box);
  to.write(record.point_count);
  to.write(record.position_bits);
  to.pad_to(64);
  write_box(to, record.position_box);
  to.write(record.weight);
  for (const float f : {record.radius_min, record.radius_max, record.cover_factor, record.theta})
    to.write(f);
  to.write(record.rms);
  to.write(record.bound);
  to.write(record.grid);
  for (const float f : record.cone.axis) to.write(f);
  to.write(record.cone.min_cosine);
  to.write(std::uint32_t{0});
  to.write(record.digest.low);
  to.write(record.digest.high);
  for (const std::uint32_t start : record.block_start) to.write(start);
  to.pad_to(kRecordFixedBytes + blocks_size_bytes(header));
  for (const SectionRef& section : record.sections) {
    to.write(section.offset);
    to.write(section.size_bytes);
    to.write(std::uint32_t{0});
    to.write(section.checksum);
  }
  CAIRN_CHECK(to.size() == out.size());
  std::ranges::copy(to.bytes(), out.begin());
}

std::optional<DecodeError> decode_record(const DatasetHeader& header, const Tree& tree, NodeId id,
                                         std::uint64_t nodes_size_bytes,
                                         std::span<const std::byte> bytes, NodeRecord& record) {
  CAIRN_CHECK(bytes.size() == record_size_bytes(header));
  const bool leaf = tree.is_leaf(id);
  record.id = id;
  FieldReader in(bytes, "the record");
  read_links(in, header, tree, id, leaf);
  read_points(in, header, tree, leaf, record);
  read_measures(in, record);
  read_blocks(in, header, leaf, record);
  read_sections(in, header, leaf, nodes_size_bytes, record);
  return in.error();
}

}  // namespace cairn::formats
