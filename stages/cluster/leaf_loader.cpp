#include "stages/cluster/leaf_loader.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/constant_size.h"
#include "formats/dataset/digest.h"
#include "formats/error.h"
#include "formats/scalar_value.h"

namespace cairn::stages {

using formats::Normal;

namespace {

/// Copies `size` bytes from every record into a dense column.
void gather(const std::byte* from, std::size_t stride, std::size_t count, std::size_t size,
            std::byte* to) {
  formats::with_constant_size(size, [&](auto constant) {
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(to + i * constant, from + i * stride, constant);
  });
}

Normal unit_normal(double x, double y, double z) {
  // Scaled by the largest component first, so that squares neither overflow nor vanish.
  const double largest = std::fmax(std::fabs(x), std::fmax(std::fabs(y), std::fabs(z)));
  if (!(largest > 0) || !std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
    return {0, 0, 0};
  x /= largest;
  y /= largest;
  z /= largest;
  const double length = std::sqrt(x * x + y * y + z * z);
  return {static_cast<float>(x / length), static_cast<float>(y / length),
          static_cast<float>(z / length)};
}

/// Of three scalars a record, the first of which stand at `at`.
std::vector<Normal> unit_normals(const std::byte* at, std::size_t stride, std::size_t count,
                                 formats::ScalarType type) {
  const std::size_t size = formats::size_bytes(type);
  std::vector<Normal> normals(count);
  for (Normal& normal : normals) {
    normal = unit_normal(formats::load_scalar(at, type), formats::load_scalar(at + size, type),
                         formats::load_scalar(at + 2 * size, type));
    at += stride;
  }
  return normals;
}

template <typename T>
void permute(std::vector<T>& values, std::span<const std::uint32_t> order) {
  std::vector<T> moved(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) moved[i] = values[order[i]];
  values = std::move(moved);
}

/// Records that are brought into order together: few enough to stay in the nearest cache.
constexpr std::size_t kBlockRecords = 256;

}  // namespace

WorkingNode load_leaf(const formats::DatasetHeader& header, const LeafRecords& records) {
  const std::size_t count = records.bytes.size() / records.stride;
  const std::byte* const first = records.bytes.data();
  WorkingNode leaf;
  leaf.data.position.resize(count);
  gather(first, records.stride, count, 12, reinterpret_cast<std::byte*>(leaf.data.position.data()));
  const formats::Schema schema = formats::record_schema(header);
  const formats::RecordLayout layout(schema, 12);
  CAIRN_CHECK(records.stride == layout.stride);
  const auto from = [&](std::string_view attribute) {
    return first + layout.offsets[*formats::find_attribute(schema, attribute)];
  };
  for (const formats::Attribute& attribute : header.schema)
    if (attribute.rule == formats::ReduceRule::kNormal)
      leaf.normal = unit_normals(from(attribute.name), records.stride, count, attribute.type);
  if (header.radius_origin != formats::RadiusOrigin::kDensity) {
    leaf.data.radius.resize(count);
    gather(from(formats::attribute_name::kRadius), records.stride, count, 4,
           reinterpret_cast<std::byte*>(leaf.data.radius.data()));
  }
  leaf.box = formats::box_of(leaf.data.position);
  leaf.weight = count;
  leaf.digest =
      formats::digest_of(records.bytes, records.stride,
                         formats::RecordLayout(formats::digest_schema(header), 12).stride);
  return leaf;
}

void reorder_leaf(WorkingNode& leaf, const formats::DatasetHeader& header,
                  const LeafRecords& records, std::span<const std::uint32_t> order) {
  permute(leaf.data.position, order);
  permute(leaf.data.radius, order);
  if (!leaf.normal.empty()) permute(leaf.normal, order);
  const formats::Schema stored = formats::record_schema(header);
  const formats::RecordLayout layout(stored, 12);
  const std::size_t stride = records.stride;
  leaf.data.attributes.resize(header.schema.size());
  std::vector<std::size_t> offsets;
  for (std::size_t a = 0; a < header.schema.size(); ++a) {
    leaf.data.attributes[a].resize(order.size() * header.schema[a].size_bytes());
    offsets.push_back(layout.offsets[*formats::find_attribute(stored, header.schema[a].name)]);
  }
  // Whole records first: each is fetched once, however many columns it has.
  std::vector<std::byte> block(kBlockRecords * stride);
  for (std::size_t first = 0; first < order.size(); first += kBlockRecords) {
    const std::size_t count = std::min(kBlockRecords, order.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(block.data() + i * stride, records.bytes.data() + order[first + i] * stride,
                  stride);
    for (std::size_t a = 0; a < header.schema.size(); ++a) {
      const std::size_t size = header.schema[a].size_bytes();
      gather(block.data() + offsets[a], stride, count, size,
             leaf.data.attributes[a].data() + first * size);
    }
  }
}

}  // namespace cairn::stages
