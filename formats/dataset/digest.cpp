#include "formats/dataset/digest.h"

#include <xxhash.h>

#include "formats/error.h"

namespace cairn::formats {

Digest digest_of(std::span<const std::byte> records, std::size_t stride) {
  CAIRN_CHECK(stride > 0 && records.size() % stride == 0);
  Digest sum;
  for (std::size_t at = 0; at < records.size(); at += stride) {
    const XXH128_hash_t hash = XXH3_128bits(records.data() + at, stride);
    sum += Digest{.low = hash.low64, .high = hash.high64};
  }
  return sum;
}

Schema digest_schema(const DatasetHeader& header) {
  Schema schema = header.schema;
  if (header.radius_from_input)
    schema.push_back({.name = std::string(attribute_name::kRadius),
                      .type = ScalarType::kF32,
                      .components = 1,
                      .rule = ReduceRule::kCoverRadius});
  return schema;
}

}  // namespace cairn::formats
