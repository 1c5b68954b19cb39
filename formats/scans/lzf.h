// LZF, the compression inside PCD files, by the Point Cloud Library.
#pragma once

#include <cstddef>
#include <span>

namespace cairn::formats {

/// No byte of LZF data stands for more bytes than this: a reference of three bytes copies at most 264.
inline constexpr std::size_t kMostLzfExpansion = 264 / 3;

/// Decompresses all of `packed` into `out`, both of less than 4 GiB. Returns false if that does not give exactly
/// out.size() bytes. Throws kSystem if the library cannot be loaded.
[[nodiscard]] bool decompress_lzf(std::span<const std::byte> packed, std::span<std::byte> out);

}  // namespace cairn::formats
