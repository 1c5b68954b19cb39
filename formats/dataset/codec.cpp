#include "formats/dataset/codec.h"

#include <lzo/lzo1x.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>

namespace cairn::formats {
namespace {

constexpr std::array<std::pair<Codec, std::string_view>, 4> kCodecNames{{
    {Codec::kNone, "none"},
    {Codec::kLzo, "lzo"},
    {Codec::kLzo999, "lzo999"},
    {Codec::kZstd, "zstd"},
}};

constexpr int kZstdLevel = 3;
constexpr std::size_t kLargestBlock = std::size_t{1} << 30;

/// The worst case of LZO1X as its documentation gives it.
constexpr std::size_t lzo_bound(std::size_t raw_size) { return raw_size + raw_size / 16 + 64 + 3; }

const bool kLzoIsUsable = lzo_init() == LZO_E_OK;

/// Grows `out` by `bound` bytes, lets `write(begin)` fill some of them and drops the rest.
template <typename Write>
void append(std::vector<std::byte>& out, std::size_t bound, Write write) {
  const std::size_t before = out.size();
  out.resize(before + bound);
  const std::size_t written = write(out.data() + before);
  CAIRN_CHECK(written <= bound);
  out.resize(before + written);
}

void compress_lzo(std::span<const std::byte> raw, bool best, std::vector<std::byte>& out) {
  CAIRN_CHECK(kLzoIsUsable);
  // LZO wants its work memory aligned for pointers; it need not be cleared.
  thread_local std::vector<void*> work;
  const std::size_t needed = best ? LZO1X_999_MEM_COMPRESS : LZO1X_1_MEM_COMPRESS;
  work.resize(std::max(work.size(), (needed + sizeof(void*) - 1) / sizeof(void*)));
  append(out, lzo_bound(raw.size()), [&](std::byte* begin) {
    const auto* in = reinterpret_cast<const unsigned char*>(raw.data());
    auto* to = reinterpret_cast<unsigned char*>(begin);
    lzo_uint size = 0;
    const int result = best ? lzo1x_999_compress(in, raw.size(), to, &size, work.data())
                            : lzo1x_1_compress(in, raw.size(), to, &size, work.data());
    CAIRN_CHECK(result == LZO_E_OK);
    return std::size_t{size};
  });
}

struct FreeContext {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

void compress_zstd(std::span<const std::byte> raw, std::vector<std::byte>& out) {
  thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
  CAIRN_CHECK(context != nullptr);
  const std::size_t bound = ZSTD_compressBound(raw.size());
  append(out, bound, [&](std::byte* begin) {
    const std::size_t size =
        ZSTD_compressCCtx(context.get(), begin, bound, raw.data(), raw.size(), kZstdLevel);
    CAIRN_CHECK(!ZSTD_isError(size));
    return size;
  });
}

DecodeError wrong_size(std::string_view codec, std::size_t found, std::size_t expected,
                       std::size_t at) {
  return {.what = std::string(codec) + " block of the wrong size",
          .byte_offset = at,
          .found = std::to_string(found) + " bytes",
          .expected = std::to_string(expected) + " bytes"};
}

std::optional<DecodeError> decompress_lzo(std::span<const std::byte> compressed,
                                          std::span<std::byte> raw) {
  CAIRN_CHECK(kLzoIsUsable);
  lzo_uint size = raw.size();
  const int result = lzo1x_decompress_safe(
      reinterpret_cast<const unsigned char*>(compressed.data()), compressed.size(),
      reinterpret_cast<unsigned char*>(raw.data()), &size, nullptr);
  if (result == LZO_E_INPUT_NOT_CONSUMED)
    return DecodeError{.what = "bytes left over behind an lzo block",
                       .byte_offset = compressed.size()};
  if (result != LZO_E_OK)
    return DecodeError{.what = "damaged lzo block", .found = "lzo error " + std::to_string(result)};
  if (size != raw.size()) return wrong_size("lzo", size, raw.size(), compressed.size());
  return std::nullopt;
}

std::optional<DecodeError> decompress_zstd(std::span<const std::byte> compressed,
                                           std::span<std::byte> raw) {
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  CAIRN_CHECK(context != nullptr);
  const std::size_t size = ZSTD_decompressDCtx(context.get(), raw.data(), raw.size(),
                                               compressed.data(), compressed.size());
  if (ZSTD_isError(size))
    return DecodeError{.what = "damaged zstd block", .found = ZSTD_getErrorName(size)};
  if (size != raw.size()) return wrong_size("zstd", size, raw.size(), compressed.size());
  return std::nullopt;
}

}  // namespace

std::string_view name_of(Codec codec) {
  for (const auto& [value, name] : kCodecNames)
    if (value == codec) return name;
  return "unknown";
}

std::optional<Codec> codec_named(std::string_view wanted) {
  for (const auto& [value, name] : kCodecNames)
    if (name == wanted) return value;
  return std::nullopt;
}

std::optional<Codec> codec_of(std::uint8_t wanted) {
  for (const auto& [value, name] : kCodecNames)
    if (static_cast<std::uint8_t>(value) == wanted) return value;
  return std::nullopt;
}

void compress(Codec codec, std::span<const std::byte> raw, std::vector<std::byte>& out) {
  CAIRN_CHECK(raw.size() <= kLargestBlock);
  switch (codec) {
    case Codec::kNone:
      out.insert(out.end(), raw.begin(), raw.end());
      return;
    case Codec::kLzo:
      return compress_lzo(raw, false, out);
    case Codec::kLzo999:
      return compress_lzo(raw, true, out);
    case Codec::kZstd:
      return compress_zstd(raw, out);
  }
  CAIRN_CHECK(!"a codec of the list");
}

std::optional<DecodeError> decompress(Codec codec, std::span<const std::byte> compressed,
                                      std::span<std::byte> raw) {
  switch (codec) {
    case Codec::kNone:
      if (compressed.size() != raw.size())
        return wrong_size("stored", compressed.size(), raw.size(), compressed.size());
      std::copy(compressed.begin(), compressed.end(), raw.begin());
      return std::nullopt;
    case Codec::kLzo:
    case Codec::kLzo999:
      return decompress_lzo(compressed, raw);
    case Codec::kZstd:
      return decompress_zstd(compressed, raw);
  }
  return DecodeError{.what = "unknown codec",
                     .found = std::to_string(static_cast<unsigned>(codec))};
}

}  // namespace cairn::formats
