#include "stages/cluster/leaf_loader.h"

#include <cmath>
#include <cstring>

#include "formats/bytes.h"
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

std::vector<Normal> unit_normals(const std::vector<std::byte>& column, formats::ScalarType type) {
  const std::size_t size = formats::size_bytes(type), count = column.size() / (3 * size);
  std::vector<Normal> normals(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* at = column.data() + 3 * size * i;
    normals[i] = unit_normal(formats::load_scalar(at, type), formats::load_scalar(at + size, type),
                             formats::load_scalar(at + 2 * size, type));
  }
  return normals;
}

template <typename T>
void permute(std::vector<T>& values, std::span<const std::uint32_t> order) {
  std::vector<T> moved(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) moved[i] = values[order[i]];
  values = std::move(moved);
}

}  // namespace

WorkingNode load_leaf(const formats::DatasetHeader& header, std::span<const std::byte> records,
                      std::size_t stride) {
  const std::size_t count = records.size() / stride;
  WorkingNode leaf;
  leaf.data.position.resize(count);
  gather(records.data(), stride, count, 12,
         reinterpret_cast<std::byte*>(leaf.data.position.data()));
  const formats::Schema schema = formats::record_schema(header);
  const formats::RecordLayout layout(schema, 12);
  CAIRN_CHECK(stride == layout.stride);
  const auto from = [&](std::string_view attribute) {
    return records.data() + layout.offsets[*formats::find_attribute(schema, attribute)];
  };
  leaf.data.attributes.resize(header.schema.size());
  for (std::size_t a = 0; a < header.schema.size(); ++a) {
    const std::size_t size = header.schema[a].size_bytes();
    leaf.data.attributes[a].resize(count * size);
    gather(from(header.schema[a].name), stride, count, size, leaf.data.attributes[a].data());
    if (header.schema[a].rule == formats::ReduceRule::kNormal)
      leaf.normal = unit_normals(leaf.data.attributes[a], header.schema[a].type);
  }
  if (header.radius_origin != formats::RadiusOrigin::kDensity) {
    leaf.data.radius.resize(count);
    gather(from(formats::attribute_name::kRadius), stride, count, 4,
           reinterpret_cast<std::byte*>(leaf.data.radius.data()));
  }
  for (const formats::GridPoint& p : leaf.data.position) leaf.box.add(p);
  leaf.weight = count;
  leaf.digest = formats::digest_of(
      records, stride, formats::RecordLayout(formats::digest_schema(header), 12).stride);
  return leaf;
}

void reorder_leaf(WorkingNode& leaf, const formats::Schema& schema,
                  std::span<const std::uint32_t> order) {
  permute(leaf.data.position, order);
  permute(leaf.data.radius, order);
  if (!leaf.normal.empty()) permute(leaf.normal, order);
  for (std::size_t a = 0; a < schema.size(); ++a) {
    const std::size_t size = schema[a].size_bytes();
    std::vector<std::byte> moved(leaf.data.attributes[a].size());
    const std::byte* from = leaf.data.attributes[a].data();
    std::byte* to = moved.data();
    formats::with_constant_size(size, [&](auto constant) {
      for (std::size_t i = 0; i < order.size(); ++i)
        std::memcpy(to + i * constant, from + order[i] * constant, constant);
    });
    leaf.data.attributes[a] = std::move(moved);
  }
}

}  // namespace cairn::stages
