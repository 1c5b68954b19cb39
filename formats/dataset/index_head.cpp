// The head of index.bin: what all nodes share, the schema, and the checksums over the rest.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/field_reader.h"
#include "formats/dataset/index_file.h"
#include "formats/dataset/record_codec.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kRootChecksumOffset = 16;
constexpr std::size_t kCheckedFrom = 24;  ///< the root checksum covers [24, pages_offset)
constexpr std::uint64_t kPageBytes = 65536;
constexpr std::uint8_t kEstimatedBit = 128;  ///< of an attribute's rule

/// The fields of the fixed part that tell where everything lies.
struct Fixed {
  std::uint32_t version = 0;
  std::uint32_t head_size_bytes = 0;
  std::uint64_t index_size_bytes = 0;
  std::uint64_t node_count = 0;
  std::uint32_t record_size_bytes = 0;
  std::uint32_t records_per_page = 0;

  std::uint64_t page_count() const {
    return node_count / records_per_page + (node_count % records_per_page != 0);
  }
};

DecodeError wrong(std::string what, std::uint64_t offset, std::uint64_t found,
                  std::uint64_t expected) {
  return {std::move(what), offset, std::to_string(found), std::to_string(expected)};
}

std::optional<DecodeError> read_fixed(std::span<const std::byte> bytes,
                                      std::uint64_t index_size_bytes, Fixed& fixed) {
  if (bytes.size() < kIndexFixedBytes)
    return wrong("the index ends early", bytes.size(), bytes.size(), kIndexFixedBytes);
  if (!std::ranges::equal(bytes.first(8), std::as_bytes(std::span(kIndexSignature))))
    return DecodeError{"not a Cairn index", 0, "another signature", "CAIRN"};
  fixed.version = load_le<std::uint32_t>(&bytes[8]);
  if (fixed.version < kOldestFormatVersion || fixed.version > kFormatVersion)
    return wrong("unknown version of the format", 8, fixed.version, kFormatVersion);
  fixed.head_size_bytes = load_le<std::uint32_t>(&bytes[12]);
  fixed.index_size_bytes = load_le<std::uint64_t>(&bytes[24]);
  fixed.node_count = load_le<std::uint64_t>(&bytes[56]);
  fixed.record_size_bytes = load_le<std::uint32_t>(&bytes[64]);
  fixed.records_per_page = load_le<std::uint32_t>(&bytes[68]);
  if (fixed.index_size_bytes != index_size_bytes)
    return wrong("wrong size of the index", 24, index_size_bytes, fixed.index_size_bytes);
  if (fixed.head_size_bytes < kIndexFixedBytes || fixed.head_size_bytes > index_size_bytes)
    return wrong("impossible size of the head", 12, fixed.head_size_bytes, kIndexFixedBytes);
  if (fixed.record_size_bytes < kRecordFixedBytes)
    return wrong("impossible size of a record", 64, fixed.record_size_bytes, kRecordFixedBytes);
  if (fixed.records_per_page == 0) return wrong("impossible number of records a page", 68, 0, 1);
  const std::uint64_t room = index_size_bytes - fixed.head_size_bytes;
  if (fixed.node_count == 0 || fixed.node_count > room / fixed.record_size_bytes)
    return wrong("impossible number of nodes", 56, fixed.node_count,
                 room / fixed.record_size_bytes);
  const std::uint64_t rest = room - fixed.node_count * fixed.record_size_bytes;
  if (rest % 8 != 0 || rest / 8 != fixed.page_count())
    return wrong("wrong size of the index", 24, index_size_bytes,
                 index_size_bytes - rest + 8 * fixed.page_count());
  return std::nullopt;
}

void read_grid(FieldReader& in, Grid& grid) {
  constexpr double kHuge = std::numeric_limits<double>::max();
  constexpr std::int64_t kMaxShift = std::int64_t{1} << 62;
  for (double& step : grid.step)
    step = in.get_in<double>("bad grid step", std::numeric_limits<double>::min(), kHuge);
  for (double& offset : grid.offset) offset = in.get_in<double>("bad grid offset", -kHuge, kHuge);
  for (std::int64_t& shift : grid.shift)
    shift = in.get_in<std::int64_t>("bad grid shift", -kMaxShift, kMaxShift);
  if (in.error()) return;
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(grid.world(axis, INT32_MIN)) || !std::isfinite(grid.world(axis, INT32_MAX)))
      in.complain("the grid reaches beyond finite numbers", "an infinite coordinate",
                  "finite coordinates");
}

/// Names are shown, written to other formats and typed by people: nothing that needs quoting.
bool is_plain_name(std::string_view name) {
  return !name.empty() && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

void read_attribute(FieldReader& in, Schema& schema) {
  Attribute attribute;
  attribute.type =
      static_cast<ScalarType>(in.get_in<std::uint8_t>("unknown type of attribute", 1, 10));
  attribute.components = in.get_in<std::uint8_t>("bad number of components", 1, 255);
  const auto rule = in.get<std::uint8_t>();
  attribute.estimated = (rule & kEstimatedBit) != 0;
  attribute.rule = static_cast<ReduceRule>(rule & ~kEstimatedBit);
  if (attribute.rule > ReduceRule::kMajority)
    in.complain("unknown rule of attribute", std::to_string(rule), "0 to 3, or these + 128");
  attribute.name = in.get_text(in.get_in<std::uint8_t>("empty name of attribute", 1, 255));
  if (!is_plain_name(attribute.name))
    in.complain("bad name of attribute", "other characters", "a to z, 0 to 9 and _");
  if (find_attribute(schema, attribute.name))
    in.complain("attribute named twice", attribute.name, "another name");
  if (!is_valid_attribute(attribute))
    in.complain("impossible attribute", attribute.name, "normals as 3 floats");
  schema.push_back(std::move(attribute));
}

void read_dataset(FieldReader& in, std::size_t head_size_bytes, DatasetHeader& dataset) {
  read_grid(in, dataset.grid);
  dataset.points = in.get_in<std::uint64_t>("impossible number of points", 1, kMaxPoints);
  dataset.target_points = in.get<std::uint64_t>();
  dataset.read_points = in.get<std::uint64_t>();
  dataset.dropped_points = in.get<std::uint64_t>();
  dataset.missing_points = in.get<std::uint64_t>();
  dataset.fanout = in.get_in<std::uint32_t>("impossible fan-out", kMinFanout, kMaxFanout);
  if (dataset.target_points < dataset.fanout)
    in.complain("impossible target of points a node", std::to_string(dataset.target_points),
                "at least " + std::to_string(dataset.fanout));
  const auto levels = in.get<std::uint32_t>();
  if (!in.error() && levels != dataset.tree().leaf_level() + 1)
    in.complain("wrong number of levels", std::to_string(levels),
                std::to_string(dataset.tree().leaf_level() + 1));
  dataset.refinement = static_cast<Refinement>(in.get_in<std::uint8_t>("unknown refinement", 0, 1));
  dataset.radius_origin =
      static_cast<RadiusOrigin>(in.get_in<std::uint8_t>("unknown origin of radii", 0, 2));
  dataset.lossless_leaves = in.get_in<std::uint8_t>("bad flag", 0, 1) != 0;
  dataset.position_bits = in.get_in<std::uint8_t>("impossible position bits", 1, 32);
  const auto attributes = in.get_in<std::uint32_t>("too many attributes", 0, kMaxAttributes);
  for (std::uint32_t i = 0; i < attributes && !in.error(); ++i) read_attribute(in, dataset.schema);
  while (!in.error() && in.position() < (in.position() + 7) / 8 * 8)
    in.get_in<std::uint8_t>("padding is not zero", 0, 0);
  if (!in.error() && in.position() != head_size_bytes)
    in.complain("wrong size of the head", std::to_string(head_size_bytes),
                std::to_string(in.position()));
}

std::uint64_t head_size_of(const DatasetHeader& header) {
  std::uint64_t size = kIndexFixedBytes;
  for (const Attribute& attribute : header.schema) size += 4 + attribute.name.size();
  return (size + 7) / 8 * 8;
}

std::optional<DecodeError> check_layout(const IndexLayout& layout, const Fixed& fixed) {
  if (fixed.node_count != layout.node_count)
    return wrong("wrong number of nodes", 56, fixed.node_count, layout.node_count);
  if (fixed.record_size_bytes != layout.record_size_bytes)
    return wrong("wrong size of a record", 64, fixed.record_size_bytes, layout.record_size_bytes);
  if (fixed.records_per_page != layout.records_per_page)
    return wrong("wrong number of records a page", 68, fixed.records_per_page,
                 layout.records_per_page);
  return std::nullopt;
}

/// Bytes of all decoded columns of a node: position, representative, weight, radius and attributes.
/// Requires node_points() <= kMaxNodePoints, so that nothing overflows.
std::uint64_t decoded_bytes(const DatasetHeader& header) {
  std::uint64_t point_bytes = 12 + 4 + 8 + 4;
  for (const Attribute& attribute : header.schema) point_bytes += attribute.size_bytes();
  return point_bytes * header.tree().node_points();
}

/// Bytes of the largest decoded column of a node. No overflow: the node's points are below 2^49.
std::uint64_t largest_column(const DatasetHeader& header) {
  std::size_t widest = 12;  // positions
  for (const Attribute& attribute : header.schema)
    widest = std::max(widest, attribute.size_bytes());
  return widest * header.tree().node_points();
}

}  // namespace

std::uint32_t version_of(const DatasetHeader& header) {
  const bool estimated =
      header.radius_origin == RadiusOrigin::kNeighbors ||
      std::ranges::any_of(header.schema, [](const Attribute& a) { return a.estimated; });
  return estimated ? kFormatVersion : kOldestFormatVersion;
}

bool is_valid_attribute(const Attribute& attribute) {
  if (!is_plain_name(attribute.name)) return false;
  const bool floats = attribute.type == ScalarType::kF32 || attribute.type == ScalarType::kF64;
  if (attribute.rule == ReduceRule::kNormal) return floats && attribute.components == 3;
  return attribute.rule != ReduceRule::kCoverRadius && attribute.name != attribute_name::kRadius;
}

IndexLayout layout_of(const DatasetHeader& header) {
  IndexLayout layout;
  layout.head_size_bytes = head_size_of(header);
  layout.node_count = header.tree().node_count();
  layout.record_size_bytes = record_size_bytes(header);
  layout.records_per_page = std::max<std::uint64_t>(1, kPageBytes / layout.record_size_bytes);
  layout.page_count = (layout.node_count + layout.records_per_page - 1) / layout.records_per_page;
  layout.pages_offset = layout.head_size_bytes + 8 * layout.page_count;
  layout.size_bytes = layout.pages_offset + layout.node_count * layout.record_size_bytes;
  return layout;
}

void check_limits(const DatasetHeader& header) {
  if (header.points == 0 || header.points > kMaxPoints)
    throw_usage(std::to_string(header.points) + " points are beyond the dataset format: 1 to " +
                std::to_string(kMaxPoints));
  if (header.schema.size() > kMaxAttributes)
    throw_usage(std::to_string(header.schema.size()) +
                " attributes are beyond the dataset format: " + std::to_string(kMaxAttributes));
  if (header.tree().node_points() > kMaxNodePoints)
    throw_usage("node-points: nodes of " + std::to_string(header.tree().node_points()) +
                " points are beyond the dataset format: " + std::to_string(kMaxNodePoints));
  if (largest_column(header) > kMaxColumnBytes)
    throw_usage("node-points: a column of a node would have " +
                std::to_string(largest_column(header)) + " bytes, more than the " +
                std::to_string(kMaxColumnBytes) + " of the dataset format");
  if (decoded_bytes(header) > kMaxNodeBytes)
    throw_usage("node-points: a node would have " + std::to_string(decoded_bytes(header)) +
                " bytes, more than the " + std::to_string(kMaxNodeBytes) +
                " of the dataset format");
  for (const Attribute& attribute : header.schema)
    if (attribute.name.size() > 255 || !is_valid_attribute(attribute))
      throw_usage("the dataset format cannot hold the attribute '" + attribute.name + "'");
}

std::vector<std::byte> write_index_head(const IndexHead& head,
                                        std::span<const std::uint64_t> page_checksums) {
  const DatasetHeader& dataset = head.dataset;
  check_limits(dataset);
  const IndexLayout layout = layout_of(dataset);
  CAIRN_CHECK(page_checksums.size() == layout.page_count);
  ByteWriter to;
  for (const std::uint8_t c : kIndexSignature) to.write(c);
  to.write(version_of(dataset));
  to.write(static_cast<std::uint32_t>(layout.head_size_bytes));
  to.write(std::uint64_t{0});  // the root checksum, known at the end
  for (const std::uint64_t v : {layout.size_bytes, head.nodes_size_bytes, head.metadata_size_bytes,
                                head.metadata_checksum, layout.node_count})
    to.write(v);
  to.write(static_cast<std::uint32_t>(layout.record_size_bytes));
  to.write(static_cast<std::uint32_t>(layout.records_per_page));
  for (const double step : dataset.grid.step) to.write(step);
  for (const double offset : dataset.grid.offset) to.write(offset);
  for (const std::int64_t shift : dataset.grid.shift) to.write(shift);
  for (const std::uint64_t v : {dataset.points, dataset.target_points, dataset.read_points,
                                dataset.dropped_points, dataset.missing_points})
    to.write(v);
  to.write(dataset.fanout);
  to.write(static_cast<std::uint32_t>(dataset.tree().leaf_level() + 1));
  to.write(static_cast<std::uint8_t>(dataset.refinement));
  to.write(static_cast<std::uint8_t>(dataset.radius_origin));
  to.write(static_cast<std::uint8_t>(dataset.lossless_leaves));
  to.write(dataset.position_bits);
  to.write(static_cast<std::uint32_t>(dataset.schema.size()));
  for (const Attribute& attribute : dataset.schema) {
    to.write(static_cast<std::uint8_t>(attribute.type));
    to.write(attribute.components);
    to.write(static_cast<std::uint8_t>(static_cast<std::uint8_t>(attribute.rule) |
                                       (attribute.estimated ? kEstimatedBit : 0)));
    to.write(static_cast<std::uint8_t>(attribute.name.size()));
    to.write_text(attribute.name);
  }
  to.pad_to(layout.head_size_bytes);
  for (const std::uint64_t sum : page_checksums) to.write(sum);
  std::vector<std::byte> bytes = std::move(to).take();
  store_le(bytes.data() + kRootChecksumOffset, checksum_of(std::span(bytes).subspan(kCheckedFrom)));
  return bytes;
}

std::optional<DecodeError> index_prefix_size(std::span<const std::byte> bytes,
                                             std::uint64_t index_size_bytes,
                                             std::uint64_t& prefix_size_bytes) {
  Fixed fixed;
  if (auto error = read_fixed(bytes, index_size_bytes, fixed)) return error;
  prefix_size_bytes = fixed.head_size_bytes + 8 * fixed.page_count();
  return std::nullopt;
}

std::uint64_t index_root_checksum(std::span<const std::byte> bytes) {
  return load_le<std::uint64_t>(&bytes[kRootChecksumOffset]);
}

std::optional<DecodeError> parse_index_head(std::span<const std::byte> bytes,
                                            std::uint64_t index_size_bytes, IndexHead& head,
                                            std::vector<std::uint64_t>& page_checksums) {
  Fixed fixed;
  if (auto error = read_fixed(bytes, index_size_bytes, fixed)) return error;
  const std::uint64_t prefix = fixed.head_size_bytes + 8 * fixed.page_count();
  if (bytes.size() < prefix)
    return wrong("the head of the index ends early", bytes.size(), bytes.size(), prefix);
  const std::uint64_t root = index_root_checksum(bytes);
  const std::uint64_t sum =
      checksum_of(bytes.subspan(kCheckedFrom, static_cast<std::size_t>(prefix) - kCheckedFrom));
  if (root != sum) return wrong("the root checksum does not match", kRootChecksumOffset, sum, root);
  head = IndexHead{};
  head.nodes_size_bytes = load_le<std::uint64_t>(&bytes[32]);
  head.metadata_size_bytes = load_le<std::uint64_t>(&bytes[40]);
  head.metadata_checksum = load_le<std::uint64_t>(&bytes[48]);
  FieldReader in(bytes.first(fixed.head_size_bytes), "the head of the index", 72);
  read_dataset(in, fixed.head_size_bytes, head.dataset);
  if (in.error()) return in.error();
  if (fixed.version != version_of(head.dataset))
    return wrong("wrong version for what the head tells", 8, fixed.version,
                 version_of(head.dataset));
  if (head.dataset.tree().node_points() > kMaxNodePoints)
    return wrong("too many points a node", 152, head.dataset.tree().node_points(), kMaxNodePoints);
  if (largest_column(head.dataset) > kMaxColumnBytes)
    return wrong("too many bytes a column of a node", 152, largest_column(head.dataset),
                 kMaxColumnBytes);
  if (decoded_bytes(head.dataset) > kMaxNodeBytes)
    return wrong("too many bytes a node", 152, decoded_bytes(head.dataset), kMaxNodeBytes);
  if (auto error = check_layout(layout_of(head.dataset), fixed)) return error;
  page_checksums.resize(static_cast<std::size_t>(fixed.page_count()));
  for (std::size_t i = 0; i < page_checksums.size(); ++i)
    page_checksums[i] = load_le<std::uint64_t>(&bytes[fixed.head_size_bytes + 8 * i]);
  return std::nullopt;
}

}  // namespace cairn::formats
