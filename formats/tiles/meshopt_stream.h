// The vertex codec of meshoptimizer, as EXT_meshopt_compression has it (mode ATTRIBUTES, no filter).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace cairn::formats {

/// The stream of `values.size() / stride_bytes` points, of version 0 of the codec: the extension knows no other.
/// Requires whole points of at least 4 bytes, a multiple of 4, up to 256.
std::vector<std::byte> encode_meshopt(std::span<const std::byte> values, std::size_t stride_bytes);

/// Fills `values`, whole points, from a stream that gives exactly these. False where it does not.
[[nodiscard]] bool decode_meshopt(std::span<const std::byte> stream, std::size_t stride_bytes,
                                  std::span<std::byte> values);

}  // namespace cairn::formats
