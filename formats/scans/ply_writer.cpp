#include "formats/scans/ply_writer.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/ply_header.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kPositionBytes = 24;

std::string_view ply_type(ScalarType type) {
  switch (type) {
    case ScalarType::kU8:
      return "uchar";
    case ScalarType::kI8:
      return "char";
    case ScalarType::kU16:
      return "ushort";
    case ScalarType::kI16:
      return "short";
    case ScalarType::kU32:
      return "uint";
    case ScalarType::kI32:
      return "int";
    case ScalarType::kF32:
      return "float";
    case ScalarType::kU64:
    case ScalarType::kI64:
    case ScalarType::kF64:
      return "double";
  }
  return "double";
}

}  // namespace

PlyWriter::PlyWriter(std::filesystem::path path, const ScanInfo& description,
                     std::uint64_t expected_points, bool replace)
    : path_(std::move(path)),
      description_(description),
      expected_points_(expected_points),
      part_(path_, replace) {
  plan_properties();
  constexpr std::size_t kPositionProperties = 3;
  if (properties_.size() + kPositionProperties > kMaxPlyProperties)
    throw_usage(
        fmt::format("cannot write {}: the attributes need {} properties, more than the {} of a "
                    "vertex",
                    path_.string(), properties_.size() + kPositionProperties, kMaxPlyProperties));
  const std::string text = header(0);
  part_.file().append(std::as_bytes(std::span(text.data(), text.size())));
}

void PlyWriter::plan_properties() {
  row_size_bytes_ = kPositionBytes;
  for (NamedComponent& component : named_components(description_.schema)) {
    const std::size_t size = size_bytes(component.type);
    properties_.push_back({std::move(component), row_size_bytes_});
    row_size_bytes_ += size;
  }
}

/// The same number of bytes for any number of points up to the expected one: the comment gives way.
std::string PlyWriter::header(std::uint64_t points) const {
  const std::string count = fmt::format("{}", points);
  const std::size_t slack = fmt::format("{}", expected_points_).size() - count.size();
  std::string text =
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment written by cairn{}\n",
                  std::string(slack, ' '));
  if (const std::string crs = crs_text(description_.crs); !crs.empty())
    text += fmt::format("comment {}{}\n", kCrsComment, crs);
  text += fmt::format("element vertex {}\n", count);
  for (const char* axis : {"x", "y", "z"}) text += fmt::format("property double {}\n", axis);
  for (const Property& property : properties_)
    text += fmt::format("property {} {}\n", ply_type(property.type), property.name);
  return text + "end_header\n";
}

void PlyWriter::write(const PointBlock& block) {
  const Schema& schema = description_.schema;
  CAIRN_CHECK(block.count <= expected_points_ - points_);
  CAIRN_CHECK(block.columns.size() == schema.size());
  for (std::size_t i = 0; i < schema.size(); ++i)
    CAIRN_CHECK(block.columns[i].size() == block.count * schema[i].size_bytes());
  const std::size_t most = block_points_for(row_size_bytes_);
  for (std::size_t first = 0; first < block.count; first += most) {
    const std::size_t count = std::min(most, block.count - first);
    rows_.resize(count * row_size_bytes_);
    encode_positions(block, first, count);
    for (const Property& property : properties_) encode_property(property, block, first, count);
    part_.file().append(rows_);
  }
  points_ += block.count;
}

void PlyWriter::encode_positions(const PointBlock& block, std::size_t first, std::size_t count) {
  const bool steps = description_.encoding == PositionEncoding::kSteps;
  CAIRN_CHECK((steps ? block.steps.size() : block.world.size()) == block.count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double world = steps ? description_.offset[axis] +
                                       description_.scale[axis] * block.steps[first + i][axis]
                                 : block.world[first + i][axis];
      store_le(rows_.data() + i * row_size_bytes_ + axis * sizeof(double), world);
    }
}

void PlyWriter::encode_property(const Property& property, const PointBlock& block,
                                std::size_t first, std::size_t count) {
  const Attribute& attribute = description_.schema[property.attribute];
  const std::size_t size = size_bytes(property.type);
  const std::byte* from = block.columns[property.attribute].data() +
                          first * attribute.size_bytes() + property.component * size;
  if (property.type == ScalarType::kU64)
    return encode_wide_integers<std::uint64_t>(property, from, count);
  if (property.type == ScalarType::kI64)
    return encode_wide_integers<std::int64_t>(property, from, count);
  std::byte* to = rows_.data() + property.offset_bytes;
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(to + i * row_size_bytes_, from + i * attribute.size_bytes(), size);
}

template <typename Integer>
void PlyWriter::encode_wide_integers(const Property& property, const std::byte* from,
                                     std::size_t count) {
  const std::size_t stride = description_.schema[property.attribute].size_bytes();
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = load_le<Integer>(from + i * stride);
    constexpr Integer kExact = Integer{1} << 53;
    if (value > kExact || (std::is_signed_v<Integer> && value < Integer{0} - kExact))
      throw_usage(fmt::format("cannot write {}: PLY has no type that holds {} = {} exactly",
                              path_.string(), property.name, value));
    store_le(rows_.data() + i * row_size_bytes_ + property.offset_bytes,
             static_cast<double>(value));
  }
}

void PlyWriter::finish() {
  const std::string text = header(points_);
  part_.file().write_at(0, std::as_bytes(std::span(text.data(), text.size())));
  part_.publish();
}

}  // namespace cairn::formats
