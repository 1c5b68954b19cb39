// General compressors of byte blocks: LZO as in the paper (Goswami et al. 2010, section III.C), and
// none and zstd for comparison. A block's size before compression is not stored here: who decompresses
// knows it, so no memory is ever allocated by a number that a damaged file claims.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/error.h"

namespace cairn::formats {

/// The values are on disk.
enum class Codec : std::uint8_t {
  kNone = 0,
  kLzo = 1,  ///< LZO1X-1: fastest
  kLzo999 =
      2,  ///< LZO1X-999, level 8: the same decompressor, smaller, some 30 times slower to compress
  kZstd = 3,  ///< zstd level 3
};

/// "none", "lzo", "lzo999", "zstd".
std::string_view name_of(Codec codec);
std::optional<Codec> codec_named(std::string_view name);
/// The codec with this value, if there is one.
std::optional<Codec> codec_of(std::uint8_t value);

/// Compresses `raw` and appends the result to `out`; kNone appends `raw` itself. The same bytes give the
/// same result for a given version of the library. Work memory is the thread's own, kept between calls.
/// Throws Error (kInvariant) if the library refuses or raw.size() is above 2^30.
void compress(Codec codec, std::span<const std::byte> raw, std::vector<std::byte>& out);

/// Restores exactly raw.size() bytes from `compressed`. Never reads or writes outside of the two spans;
/// anything that does not yield that many bytes, or leaves compressed bytes over, is a DecodeError.
/// After an error the content of `raw` is unspecified.
[[nodiscard]] std::optional<DecodeError> decompress(Codec codec,
                                                    std::span<const std::byte> compressed,
                                                    std::span<std::byte> raw);

}  // namespace cairn::formats
