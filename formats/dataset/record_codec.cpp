#include "formats/dataset/record_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

std::size_t blocks_size_bytes(const DatasetHeader& header) {
  const std::size_t size = sizeof(std::uint32_t) * (std::size_t{header.fanout} + 1);
  return (size + 7) / 8 * 8;
}

/// Writes the fields of a record one after the other.
class FieldWriter {
 public:
  explicit FieldWriter(std::span<std::byte> out) : out_(out) {}
  template <Scalar T>
  void put(T value) {
    CAIRN_CHECK(out_.size() - at_ >= sizeof(T));
    store_le(out_.data() + at_, value);
    at_ += sizeof(T);
  }
  void put(const GridBox& box) {
    for (const std::int32_t c : box.min) put(c);
    for (const std::int32_t c : box.max) put(c);
  }
  void zero_to(std::size_t end) {
    while (at_ < end) put(std::uint8_t{0});
  }

 private:
  std::span<std::byte> out_;
  std::size_t at_ = 0;
};

/// Reads the fields of a record and keeps the first thing that is wrong with them.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <Scalar T>
  T get() {
    CAIRN_CHECK(bytes_.size() - at_ >= sizeof(T));
    const T value = load_le<T>(bytes_.data() + at_);
    field_ = at_;
    at_ += sizeof(T);
    return value;
  }
  GridBox get_box(const char* what) {
    GridBox box;
    const std::size_t begin = at_;
    for (std::int32_t& c : box.min) c = get<std::int32_t>();
    for (std::int32_t& c : box.max) c = get<std::int32_t>();
    field_ = begin;
    for (int a = 0; a < 3; ++a)
      require(box.min[a] <= box.max[a], what, "an empty box", "min <= max on every axis");
    return box;
  }
  template <Scalar T>
  void get_equal(const char* what, T expected) {
    const T value = get<T>();
    require(value == expected, what, value, std::to_string(expected));
  }
  template <Scalar T>
  T get_in(const char* what, T low, T high) {
    const T value = get<T>();
    require(value >= low && value <= high, what, value,
            std::to_string(low) + " to " + std::to_string(high));
    return value;
  }
  template <typename Found>
  void require(bool condition, const char* what, const Found& found, std::string expected) {
    if (condition || error_) return;
    if constexpr (Scalar<Found>)
      error_ = DecodeError{what, field_, std::to_string(found), std::move(expected)};
    else
      error_ = DecodeError{what, field_, found, std::move(expected)};
  }
  std::size_t position() const { return at_; }
  const std::optional<DecodeError>& error() const { return error_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t field_ = 0;
  std::optional<DecodeError> error_;
};

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
  FieldWriter to(out);
  to.put(value_of(record.id));
  to.put(parent_field(tree, record.id));
  to.put(first_child_field(tree, record.id, leaf));
  to.put<std::uint32_t>(leaf ? 0 : header.fanout);
  to.put<std::uint32_t>(tree.level_of(record.id));
  to.put(record.box);
  to.put(record.point_count);
  to.put(record.position_bits);
  to.zero_to(64);
  to.put(record.position_box);
  to.put(record.weight);
  for (const float f : {record.radius_min, record.radius_max, record.cover_factor, record.theta})
    to.put(f);
  to.put(record.rms);
  to.put(record.bound);
  to.put(record.grid);
  for (const float f : record.cone.axis) to.put(f);
  to.put(record.cone.min_cosine);
  to.put(std::uint32_t{0});
  to.put(record.digest.low);
  to.put(record.digest.high);
  for (const std::uint32_t start : record.block_start) to.put(start);
  to.zero_to(kRecordFixedBytes + blocks_size_bytes(header));
  for (const SectionRef& section : record.sections) {
    to.put(section.offset);
    to.put(section.size_bytes);
    to.put(std::uint32_t{0});
    to.put(section.checksum);
  }
}

std::optional<DecodeError> decode_record(const DatasetHeader& header, const Tree& tree, NodeId id,
                                         std::uint64_t nodes_size_bytes,
                                         std::span<const std::byte> bytes, NodeRecord& record) {
  CAIRN_CHECK(bytes.size() == record_size_bytes(header));
  const bool leaf = tree.is_leaf(id);
  record.id = id;
  FieldReader in(bytes);
  read_links(in, header, tree, id, leaf);
  read_points(in, header, tree, leaf, record);
  read_measures(in, record);
  read_blocks(in, header, leaf, record);
  read_sections(in, header, leaf, nodes_size_bytes, record);
  return in.error();
}

}  // namespace cairn::formats
