#include "formats/checksum.h"

#include <xxhash.h>

namespace cairn::formats {

std::uint64_t checksum_of(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace cairn::formats
