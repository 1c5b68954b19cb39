#include "formats/dataset/node_codec.h"

#include <algorithm>
#include <string>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/node_frame.h"
#include "formats/dataset/node_section.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/quantize.h"

namespace cairn::formats {
namespace {

using Bytes = std::span<const std::byte>;

template <typename T>
Bytes bytes_of(const std::vector<T>& column) {
  return std::as_bytes(std::span(column));
}

/// Appends encoded sections to the node's bytes and notes where each lies.
class SectionWriter {
 public:
  SectionWriter(Codec codec, NodeRecord& record) : codec_(codec), record_(record) {}

  void add(std::size_t section, Bytes column, const ColumnShape& shape) {
    CAIRN_CHECK(column.size() == shape.size_bytes());
    const std::vector<std::byte> bytes = encode_section(column, shape, codec_);
    CAIRN_CHECK(!bytes.empty() && bytes.size() <= UINT32_MAX);
    record_.sections[section] = {.offset = blob_.size(),
                                 .size_bytes = static_cast<std::uint32_t>(bytes.size()),
                                 .checksum = checksum_of(bytes)};
    blob_.insert(blob_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> take() && { return std::move(blob_); }

 private:
  Codec codec_;
  NodeRecord& record_;
  std::vector<std::byte> blob_;
};

void add_positions(const NodeFrame& frame, const NodeData& points, SectionWriter& to) {
  const PositionQuantizer quantizer(frame.position_box(), frame.position_bits());
  const auto add = [&](auto code) {
    std::vector<decltype(code)> codes(points.count() * 3);
    quantizer.encode(points.position, codes);
    to.add(kPositionSection, bytes_of(codes), {quantizer.code_type(), 3, points.count()});
  };
  if (quantizer.code_type() == ScalarType::kU16)
    add(std::uint16_t{});
  else
    add(std::uint32_t{});
}

/// How many points each representative stands for, from the first to the last that is named.
std::vector<std::uint32_t> runs_of(const std::vector<std::uint32_t>& representatives) {
  std::vector<std::uint32_t> runs;
  std::uint32_t previous = representatives.front();
  const std::uint32_t first = previous;
  for (const std::uint32_t r : representatives) {
    CAIRN_CHECK(r >= previous && r - first < kMaxNodePoints);
    previous = r;
    runs.resize(r - first + 1);
    ++runs.back();
  }
  return runs;
}

/// Leaves are grouped by representative and need the length of each group only; the points of an inner
/// node name theirs, counted from the first of the block.
void add_representatives(const NodeData& points, bool leaf, SectionWriter& to) {
  CAIRN_CHECK(points.representative.size() == points.count());
  std::vector<std::uint32_t> column;
  if (leaf) {
    column = runs_of(points.representative);
  } else {
    column = points.representative;
    const std::uint32_t first = std::ranges::min(column);
    for (std::uint32_t& r : column) r -= first;
  }
  to.add(kRepresentativeSection, bytes_of(column), {ScalarType::kU32, 1, column.size()});
}

void add_radii(const NodeFrame& frame, const NodeData& points, SectionWriter& to) {
  if (frame.radii_exact())
    return to.add(kRadiusSection, bytes_of(points.radius), {ScalarType::kF32, 1, points.count()});
  std::vector<std::uint8_t> codes(points.count());
  RadiusQuantizer(frame.radius_min(), frame.radius_max()).encode(points.radius, codes);
  to.add(kRadiusSection, bytes_of(codes), {ScalarType::kU8, 1, points.count()});
}

void add_attribute(const NodeFrame& frame, const Attribute& attribute, std::size_t section,
                   Bytes column, std::size_t count, SectionWriter& to) {
  CAIRN_CHECK(column.size() == attribute.size_bytes() * count);
  if (attribute.rule != ReduceRule::kNormal || frame.normals_exact())
    return to.add(section, column, {attribute.type, attribute.components, count});
  to.add(section, bytes_of(encode_normal_column(column, attribute.type)),
         {ScalarType::kU16, 1, count});
}

/// Decodes one section after the other; an error keeps the number of its section.
class SectionReader {
 public:
  SectionReader(const NodeRecord& record, std::span<const Bytes> bytes, const SectionSet& wanted)
      : record_(record), bytes_(bytes), wanted_(wanted) {}

  bool wants(std::size_t section) const {
    return wanted_[section] && record_.sections[section].size_bytes != 0;
  }

  /// Reads a column whose scalars are of type T, or its bytes.
  template <typename T>
  bool read(std::size_t section, const ColumnShape& shape, std::vector<T>& column) {
    column.resize(shape.size_bytes() / sizeof(T));
    auto error = decode_section(bytes_[section], shape, std::as_writable_bytes(std::span(column)));
    if (error) fail(section, std::move(*error));
    return !error_;
  }
  void fail(std::size_t section, DecodeError error) {
    if (error_) return;
    failed_section_ = section;
    error_ = std::move(error);
  }
  const std::optional<DecodeError>& error() const { return error_; }
  std::size_t failed_section() const { return failed_section_; }

 private:
  const NodeRecord& record_;
  std::span<const Bytes> bytes_;
  const SectionSet& wanted_;
  std::optional<DecodeError> error_;
  std::size_t failed_section_ = 0;
};

template <typename Code>
void read_positions(SectionReader& in, const PositionQuantizer& quantizer, std::size_t count,
                    NodeData& points) {
  std::vector<Code> codes;
  if (!in.read(kPositionSection, {quantizer.code_type(), 3, count}, codes)) return;
  if (const auto bad = quantizer.first_beyond(codes)) {
    const auto axis = static_cast<int>(*bad % 3);
    return in.fail(kPositionSection,
                   {.what = "a position code above the largest",
                    .found = std::to_string(codes[*bad]),
                    .expected = "at most " + std::to_string(quantizer.max_code(axis))});
  }
  points.position.resize(count);
  quantizer.decode(codes, points.position);
}

void read_runs(SectionReader& in, IndexRange representatives, std::size_t count, NodeData& points) {
  std::vector<std::uint32_t> runs;
  if (!in.read(kRepresentativeSection, {ScalarType::kU32, 1, representatives.count}, runs)) return;
  std::uint64_t total = 0;
  for (const std::uint32_t run : runs) total += run;
  if (total != count)
    return in.fail(kRepresentativeSection,
                   {.what = "the representatives stand for a wrong number of points",
                    .found = std::to_string(total),
                    .expected = std::to_string(count)});
  points.representative.reserve(count);
  for (std::size_t i = 0; i < runs.size(); ++i)
    points.representative.insert(points.representative.end(), runs[i],
                                 static_cast<std::uint32_t>(representatives.first + i));
}

void read_choices(SectionReader& in, IndexRange representatives, std::size_t count,
                  NodeData& points) {
  if (!in.read(kRepresentativeSection, {ScalarType::kU32, 1, count}, points.representative)) return;
  for (std::uint32_t& r : points.representative) {
    if (r >= representatives.count)
      return in.fail(kRepresentativeSection,
                     {.what = "a representative beyond the parent's block",
                      .found = std::to_string(r),
                      .expected = "below " + std::to_string(representatives.count)});
    r += static_cast<std::uint32_t>(representatives.first);
  }
}

void read_radii(SectionReader& in, const NodeFrame& frame, std::size_t count, NodeData& points) {
  if (!frame.radii_exact()) {
    std::vector<std::uint8_t> codes;
    if (!in.read(kRadiusSection, {ScalarType::kU8, 1, count}, codes)) return;
    points.radius.resize(count);
    return RadiusQuantizer(frame.radius_min(), frame.radius_max()).decode(codes, points.radius);
  }
  if (!in.read(kRadiusSection, {ScalarType::kF32, 1, count}, points.radius)) return;
  for (const float radius : points.radius)
    if (!(radius >= frame.radius_min() && radius <= frame.radius_max()))
      return in.fail(kRadiusSection, {.what = "a radius beyond the node's extremes",
                                      .found = std::to_string(radius),
                                      .expected = std::to_string(frame.radius_min()) + " to " +
                                                  std::to_string(frame.radius_max())});
}

void read_attribute(SectionReader& in, const NodeFrame& frame, const Attribute& attribute,
                    std::size_t section, std::size_t count, std::vector<std::byte>& column) {
  if (attribute.rule != ReduceRule::kNormal || frame.normals_exact()) {
    in.read(section, {attribute.type, attribute.components, count}, column);
    return;
  }
  std::vector<std::uint16_t> codes;
  if (in.read(section, {ScalarType::kU16, 1, count}, codes))
    column = decode_normal_column(codes, attribute.type);
}

}  // namespace

std::vector<std::byte> encode_node(const NodeData& points, const DatasetHeader& header, bool leaf,
                                   Codec codec, NodeRecord& record) {
  if (points.count() > kMaxNodePoints)
    throw_usage("a node of " + std::to_string(points.count()) +
                " points is beyond the dataset format");
  const NodeFrame frame = NodeFrame::fit(header, leaf, points);
  record.point_count = static_cast<std::uint32_t>(points.count());
  record.position_bits = frame.position_bits();
  record.position_box = frame.position_box();
  record.radius_min = frame.radius_min();
  record.radius_max = frame.radius_max();
  record.sections.assign(section_count(header), SectionRef{});
  SectionWriter to(codec, record);
  const bool root = points.representative.empty();
  CAIRN_CHECK(root == (value_of(record.id) == 0));
  CAIRN_CHECK(points.attributes.size() == header.schema.size());
  add_positions(frame, points, to);
  if (!root) add_representatives(points, leaf, to);
  if (!leaf) to.add(kWeightSection, bytes_of(points.weight), {ScalarType::kU64, 1, points.count()});
  add_radii(frame, points, to);
  for (std::size_t i = 0; i < header.schema.size(); ++i)
    if (has_section(header, kFirstAttributeSection + i, root, leaf))
      add_attribute(frame, header.schema[i], kFirstAttributeSection + i, points.attributes[i],
                    points.count(), to);
  return std::move(to).take();
}

std::optional<DecodeError> decode_node(const DatasetHeader& header, const NodeRecord& record,
                                       IndexRange representatives, std::span<const Bytes> bytes,
                                       const SectionSet& wanted, NodeData& points,
                                       std::size_t& failed_section) {
  CAIRN_CHECK(bytes.size() == section_count(header) && record.sections.size() == bytes.size());
  const bool leaf = header.tree().is_leaf(record.id);
  const NodeFrame frame = NodeFrame::of(header, leaf, record);
  const std::size_t count = record.point_count;
  points = NodeData{};
  points.attributes.resize(header.schema.size());
  SectionReader in(record, bytes, wanted);
  if (in.wants(kPositionSection)) {
    const PositionQuantizer quantizer(frame.position_box(), frame.position_bits());
    if (quantizer.code_type() == ScalarType::kU16)
      read_positions<std::uint16_t>(in, quantizer, count, points);
    else
      read_positions<std::uint32_t>(in, quantizer, count, points);
  }
  if (in.wants(kRepresentativeSection))
    (leaf ? read_runs : read_choices)(in, representatives, count, points);
  if (in.wants(kWeightSection))
    in.read(kWeightSection, {ScalarType::kU64, 1, count}, points.weight);
  if (in.wants(kRadiusSection)) read_radii(in, frame, count, points);
  for (std::size_t i = 0; i < header.schema.size(); ++i)
    if (in.wants(kFirstAttributeSection + i))
      read_attribute(in, frame, header.schema[i], kFirstAttributeSection + i, count,
                     points.attributes[i]);
  failed_section = in.failed_section();
  return in.error();
}

}  // namespace cairn::formats
