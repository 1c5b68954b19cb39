#include "formats/dataset/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace cairn::formats {
namespace {

constexpr std::array kCodecs{Codec::kNone, Codec::kLzo, Codec::kLzo999, Codec::kZstd};
using Bytes = std::vector<std::byte>;

/// Bytes from noise (`symbols` = 256) to a single value (1).
Bytes bytes_of(std::size_t size, unsigned symbols, unsigned seed = 1) {
  std::mt19937 random(seed);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random() % symbols);
  return bytes;
}

Bytes compressed(Codec codec, const Bytes& raw) {
  Bytes out;
  compress(codec, raw, out);
  return out;
}

/// Decompresses into an allocation of exactly `size` bytes, so that a sanitizer sees any byte too far.
std::optional<DecodeError> decompress_exactly(Codec codec, const Bytes& packed, std::size_t size,
                                              Bytes* raw = nullptr) {
  const Bytes input(packed);
  Bytes out(size);
  out.shrink_to_fit();
  auto error = decompress(codec, input, out);
  if (raw != nullptr) *raw = std::move(out);
  return error;
}

TEST(Codec, NamesRoundTrip) {
  for (const Codec codec : kCodecs) {
    EXPECT_EQ(codec_named(name_of(codec)), codec);
    EXPECT_EQ(codec_of(static_cast<std::uint8_t>(codec)), codec);
  }
  EXPECT_EQ(name_of(Codec::kLzo999), "lzo999");
  EXPECT_FALSE(codec_named("LZO").has_value());
  EXPECT_FALSE(codec_named("").has_value());
  EXPECT_FALSE(codec_of(4).has_value());
}

TEST(Codec, RestoresEverySizeAndKindOfBytes) {
  for (const Codec codec : kCodecs)
    for (const std::size_t size : {0, 1, 2, 3, 4, 20, 21, 255, 4096, 65536, 70'000})
      for (const unsigned symbols : {1u, 2u, 17u, 256u}) {
        const Bytes raw = bytes_of(size, symbols);
        Bytes back;
        const auto error = decompress_exactly(codec, compressed(codec, raw), size, &back);
        ASSERT_FALSE(error.has_value()) << name_of(codec) << ' ' << size << ": " << error->what;
        ASSERT_EQ(back, raw) << name_of(codec) << ' ' << size;
      }
}

TEST(Codec, AppendsBehindWhatIsThere) {
  for (const Codec codec : kCodecs) {
    const Bytes raw = bytes_of(1000, 4);
    Bytes out = bytes_of(7, 256, 9);
    const Bytes before = out;
    compress(codec, raw, out);
    EXPECT_TRUE(std::equal(before.begin(), before.end(), out.begin()));
    EXPECT_EQ(Bytes(out.begin() + 7, out.end()), compressed(codec, raw));
  }
}

TEST(Codec, ResultDoesNotDependOnWhatWasCompressedBefore) {
  const Bytes raw = bytes_of(50'000, 5);
  for (const Codec codec : kCodecs) {
    const Bytes first = compressed(codec, raw);
    compressed(codec, bytes_of(60'000, 3, 77));
    compressed(Codec::kLzo999, bytes_of(100'000, 200, 78));
    EXPECT_EQ(compressed(codec, raw), first) << name_of(codec);
  }
}

TEST(Codec, RefusesEveryTruncation) {
  for (const Codec codec : kCodecs) {
    const Bytes raw = bytes_of(300, 3);
    const Bytes packed = compressed(codec, raw);
    for (std::size_t size = 0; size < packed.size(); ++size)
      ASSERT_TRUE(decompress_exactly(
          codec, Bytes(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)), 300))
          << name_of(codec) << ' ' << size;
  }
}

TEST(Codec, RefusesBytesLeftOverAndOtherSizes) {
  for (const Codec codec : kCodecs) {
    const Bytes raw = bytes_of(300, 3);
    Bytes packed = compressed(codec, raw);
    EXPECT_TRUE(decompress_exactly(codec, packed, 299).has_value()) << name_of(codec);
    EXPECT_TRUE(decompress_exactly(codec, packed, 301).has_value()) << name_of(codec);
    EXPECT_TRUE(decompress_exactly(codec, packed, 0).has_value()) << name_of(codec);
    packed.push_back(std::byte{0});
    EXPECT_TRUE(decompress_exactly(codec, packed, 300).has_value()) << name_of(codec);
  }
}

TEST(Codec, SurvivesEveryFlippedBit) {
  for (const Codec codec : kCodecs) {
    Bytes packed = compressed(codec, bytes_of(300, 3));
    for (std::size_t bit = 0; bit < packed.size() * 8; ++bit) {
      packed[bit / 8] ^= std::byte{1} << (bit % 8);
      static_cast<void>(
          decompress_exactly(codec, packed, 300));  // an error or 300 bytes; never a crash
      packed[bit / 8] ^= std::byte{1} << (bit % 8);
    }
  }
}

TEST(Codec, ErrorSaysWhatAndWhere) {
  const auto error = decompress_exactly(Codec::kNone, bytes_of(9, 256), 10);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->found, "9 bytes");
  EXPECT_EQ(error->expected, "10 bytes");
  EXPECT_EQ(error->byte_offset, 9u);
  EXPECT_TRUE(decompress_exactly(static_cast<Codec>(200), bytes_of(9, 256), 9).has_value());
}

}  // namespace
}  // namespace cairn::formats
