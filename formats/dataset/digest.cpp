#include "formats/dataset/digest.h"

#include <xxhash.h>

#include "formats/error.h"

namespace cairn::formats {

namespace {

Attribute radius_attribute() {
  return {.name = std::string(attribute_name::kRadius),
          .type = ScalarType::kF32,
          .components = 1,
          .rule = ReduceRule::kCoverRadius};
}

}  // namespace

Digest digest_of(std::span<const std::byte> records, std::size_t stride) {
  return digest_of(records, stride, stride);
}

Digest digest_of(std::span<const std::byte> records, std::size_t stride,
                 std::size_t digested_bytes) {
  CAIRN_CHECK(stride > 0 && records.size() % stride == 0);
  CAIRN_CHECK(digested_bytes <= stride);
  Digest sum;
  for (std::size_t at = 0; at < records.size(); at += stride) {
    const XXH128_hash_t hash = XXH3_128bits(records.data() + at, digested_bytes);
    sum += Digest{.low = hash.low64, .high = hash.high64};
  }
  return sum;
}

Schema digest_schema(const DatasetHeader& header) {
  Schema schema;
  for (const Attribute& attribute : header.schema)
    if (!attribute.estimated) schema.push_back(attribute);
  if (header.radius_origin == RadiusOrigin::kInput) schema.push_back(radius_attribute());
  return schema;
}

Schema record_schema(const DatasetHeader& header) {
  Schema schema = digest_schema(header);
  for (const Attribute& attribute : header.schema)
    if (attribute.estimated) schema.push_back(attribute);
  if (header.radius_origin == RadiusOrigin::kNeighbors) schema.push_back(radius_attribute());
  return schema;
}

}  // namespace cairn::formats
