#include "formats/tiles/meshopt_stream.h"

#include <meshoptimizer.h>

#include "formats/error.h"

namespace cairn::formats {
namespace {

/// The first byte of a stream: 0xa in the upper half, the version in the lower one.
constexpr std::byte kVersion0{0xa0};

bool is_stride(std::size_t bytes) { return bytes >= 4 && bytes <= 256 && bytes % 4 == 0; }

}  // namespace

std::vector<std::byte> encode_meshopt(std::span<const std::byte> values, std::size_t stride_bytes) {
  CAIRN_CHECK(is_stride(stride_bytes) && values.size() % stride_bytes == 0);
  // The version is a setting of the whole process; later libraries begin with a newer one.
  static const bool version_is_set = (meshopt_encodeVertexVersion(0), true);
  const std::size_t count = values.size() / stride_bytes;
  std::vector<std::byte> stream(meshopt_encodeVertexBufferBound(count, stride_bytes));
  const std::size_t size =
      meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(stream.data()), stream.size(),
                                 values.data(), count, stride_bytes);
  CAIRN_CHECK(version_is_set && size > 0 && stream.front() == kVersion0);
  stream.resize(size);
  return stream;
}

bool decode_meshopt(std::span<const std::byte> stream, std::size_t stride_bytes,
                    std::span<std::byte> values) {
  if (!is_stride(stride_bytes) || values.size() % stride_bytes != 0) return false;
  if (stream.empty() || stream.front() != kVersion0) return false;
  return meshopt_decodeVertexBuffer(values.data(), values.size() / stride_bytes, stride_bytes,
                                    reinterpret_cast<const unsigned char*>(stream.data()),
                                    stream.size()) == 0;
}

}  // namespace cairn::formats
