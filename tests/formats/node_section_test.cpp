#include "formats/dataset/node_section.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/columns.h"

namespace cairn::formats {
namespace {

using tests::Bytes;
using tests::Content;
using tests::make_column;

constexpr std::array kCodecs{Codec::kNone, Codec::kLzo, Codec::kLzo999, Codec::kZstd};
constexpr std::size_t kHeadBytes = 2;

/// Decodes into an allocation of exactly the column's size, from one of exactly the section's size.
std::optional<DecodeError> decode_exactly(const Bytes& section, const ColumnShape& shape,
                                          Bytes& column) {
  const Bytes input(section);
  column.assign(shape.size_bytes(), std::byte{0xa5});
  column.shrink_to_fit();
  return decode_section(input, shape, column);
}

void expect_round_trip(const Bytes& column, const ColumnShape& shape, Codec codec) {
  const Bytes section = encode_section(column, shape, codec);
  EXPECT_LE(section.size(), column.size() + kHeadBytes);
  Bytes back;
  const auto error = decode_exactly(section, shape, back);
  ASSERT_FALSE(error.has_value()) << error->what;
  ASSERT_EQ(back, column) << name_of(codec) << ", " << shape.count << " points of "
                          << shape.components << ' ' << name_of(shape.type);
}

TEST(NodeSection, RestoresEveryTypeCountAndContent) {
  for (const ScalarType type : tests::kAllTypes)
    for (const std::uint32_t components : {1u, 2u, 3u, 29u})
      for (const std::size_t count : {0, 1, 2, 31, 32, 33, 64, 65, 1000})
        for (const Content content : tests::kAllContents)
          for (const Codec codec : {Codec::kNone, Codec::kLzo, Codec::kZstd}) {
            const ColumnShape shape{type, components, count};
            expect_round_trip(make_column(shape, content), shape, codec);
          }
}

TEST(NodeSection, RestoresWholeNodes) {
  for (const ScalarType type : tests::kAllTypes)
    for (const Content content : tests::kAllContents)
      for (const Codec codec : {Codec::kLzo, Codec::kZstd}) {
        const ColumnShape shape{type, type == ScalarType::kU16 ? 3u : 1u, 65536};
        expect_round_trip(make_column(shape, content), shape, codec);
      }
  const ColumnShape shape{ScalarType::kU8, 1, 20'000};
  expect_round_trip(make_column(shape, Content::kWalk), shape, Codec::kLzo999);
}

TEST(NodeSection, KeepsEveryBitPatternOfFloats) {
  using Limits = std::numeric_limits<float>;
  std::vector<float> values{0.0f,
                            -0.0f,
                            Limits::infinity(),
                            -Limits::infinity(),
                            Limits::denorm_min(),
                            Limits::max(),
                            std::bit_cast<float>(0x7fc12345u),
                            std::bit_cast<float>(0xff800001u)};
  for (int i = 0; i < 100; ++i) values.push_back(std::sqrt(static_cast<float>(i)));
  for (const Codec codec : kCodecs)
    expect_round_trip(tests::bytes_of(values), {ScalarType::kF32, 1, values.size()}, codec);
  std::vector<double> times;
  for (int i = 0; i < 500; ++i) times.push_back(2.5e8 + i * 1e-5 + (i % 7) * 100.25);
  times.push_back(std::bit_cast<double>(0x7ff0000000000001u));
  for (const Codec codec : kCodecs)
    expect_round_trip(tests::bytes_of(times), {ScalarType::kF64, 1, times.size()}, codec);
}

TEST(NodeSection, ConstantColumnCostsAFewBytes) {
  for (const ScalarType type : tests::kAllTypes) {
    const ColumnShape shape{type, 1, 65536};
    const Bytes column = make_column(shape, Content::kConstant);
    EXPECT_EQ(encode_section(column, shape, Codec::kLzo).size(), kHeadBytes + size_bytes(type));
  }
}

TEST(NodeSection, StaysSmallOnWhatNodesHold) {
  std::mt19937 random(1);
  const auto bytes_a_point = [](const auto& values, ScalarType type, std::uint32_t components) {
    const ColumnShape shape{type, components, values.size() / components};
    const auto section = encode_section(tests::bytes_of(values), shape, Codec::kLzo);
    return static_cast<double>(section.size()) / static_cast<double>(shape.count);
  };
  std::vector<std::uint32_t> index(65536);
  for (std::size_t i = 1; i < index.size(); ++i)
    index[i] = index[i - 1] + (random() % 4 == 0 ? 1 : 0);
  EXPECT_LT(bytes_a_point(index, ScalarType::kU32, 1), 0.145);

  std::vector<std::uint8_t> radius(65536);
  for (std::size_t i = 0; i < radius.size(); ++i)
    radius[i] = i % 16 == 0 ? static_cast<std::uint8_t>(60 + random() % 64) : radius[i - 1];
  EXPECT_LT(bytes_a_point(radius, ScalarType::kU8, 1), 0.09);

  // Uniform differences below 2^9 have 9 bits of entropy; a Golomb-Rice code may cost one more.
  std::vector<std::uint16_t> position(3 * 65536);
  for (std::size_t i = 3; i < position.size(); ++i)
    position[i] = static_cast<std::uint16_t>(position[i - 3] + random() % 512 - 256);
  EXPECT_LT(bytes_a_point(position, ScalarType::kU16, 3), 3 * 10.0 / 8);

  // A byte of noise in 16-bit fields.
  std::vector<std::uint16_t> colour(3 * 65536);
  for (std::uint16_t& c : colour) c = static_cast<std::uint16_t>(random() % 256 * 257);
  EXPECT_LT(bytes_a_point(colour, ScalarType::kU16, 3), 3.1);
}

TEST(NodeSection, StretchThatMisleadsIsNeverLargerThanTheColumn) {
  const ColumnShape shape{ScalarType::kU8, 1, 65536};
  Bytes column = make_column(shape, Content::kNoise);
  // The middle, on which the ways to store are tried, is one long run.
  for (std::size_t i = 30'000; i < 36'000; ++i) column[i] = std::byte{7};
  for (const Codec codec : {Codec::kNone, Codec::kLzo, Codec::kZstd})
    expect_round_trip(column, shape, codec);
}

TEST(NodeSection, SameColumnGivesSameBytes) {
  const ColumnShape shape{ScalarType::kU16, 3, 5000};
  const Bytes column = make_column(shape, Content::kWalk);
  for (const Codec codec : kCodecs) {
    const Bytes first = encode_section(column, shape, codec);
    encode_section(make_column({ScalarType::kF64, 2, 7000}, Content::kNoise),
                   {ScalarType::kF64, 2, 7000}, codec);
    EXPECT_EQ(encode_section(column, shape, codec), first);
  }
}

TEST(NodeSection, RefusesEveryTruncationAndExtension) {
  for (const ColumnShape shape :
       {ColumnShape{ScalarType::kU16, 3, 70}, ColumnShape{ScalarType::kU8, 1, 90}})
    for (const Content content : tests::kAllContents)
      for (const Codec codec : kCodecs) {
        Bytes section = encode_section(make_column(shape, content), shape, codec);
        Bytes back;
        for (std::size_t size = 0; size < section.size(); ++size)
          ASSERT_TRUE(decode_exactly(
              Bytes(section.begin(), section.begin() + static_cast<std::ptrdiff_t>(size)), shape,
              back))
              << name_of(codec) << ' ' << size << " of " << section.size();
        section.push_back(std::byte{0});
        ASSERT_TRUE(decode_exactly(section, shape, back)) << name_of(codec);
      }
}

TEST(NodeSection, SurvivesEveryFlippedBit) {
  for (const ColumnShape shape :
       {ColumnShape{ScalarType::kU16, 3, 70}, ColumnShape{ScalarType::kU16, 1, 90},
        ColumnShape{ScalarType::kU64, 1, 65}, ColumnShape{ScalarType::kU8, 1, 300}})
    for (const Content content : tests::kAllContents)
      for (const Codec codec : kCodecs) {
        Bytes section = encode_section(make_column(shape, content), shape, codec);
        Bytes back;
        for (std::size_t bit = 0; bit < section.size() * 8; ++bit) {
          section[bit / 8] ^= std::byte{1} << (bit % 8);
          const auto error =
              decode_exactly(section, shape, back);  // an error or a column of the same size
          if (error) {
            ASSERT_FALSE(error->what.empty());
          }
          section[bit / 8] ^= std::byte{1} << (bit % 8);
        }
      }
}

TEST(NodeSection, RefusesSectionsOfAnotherShape) {
  const ColumnShape shape{ScalarType::kU16, 3, 64};
  const Bytes section = encode_section(make_column(shape, Content::kWalk), shape, Codec::kLzo);
  Bytes back;
  for (const ColumnShape other :
       {ColumnShape{ScalarType::kU16, 3, 65}, ColumnShape{ScalarType::kU16, 3, 63},
        ColumnShape{ScalarType::kU16, 3, 0}, ColumnShape{ScalarType::kU16, 2, 64}})
    EXPECT_TRUE(decode_exactly(section, other, back).has_value());
}

TEST(NodeSection, RefusesClaimsOfHugeSizesBeforeAllocating) {
  // Filter planes, codec zstd, 4 GiB claimed.
  const std::vector<std::uint8_t> section{3, 3, 255, 255, 255, 255, 1, 2, 3};
  Bytes back;
  const auto error = decode_exactly(tests::bytes_of(section), {ScalarType::kU8, 1, 16}, back);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->byte_offset, 2u);
  EXPECT_EQ(error->found, "4294967295");
}

TEST(NodeSection, SaysHowItIsStored) {
  const ColumnShape shape{ScalarType::kU8, 1, 100};
  const auto storage =
      storage_of(encode_section(make_column(shape, Content::kZero), shape, Codec::kLzo));
  ASSERT_TRUE(storage.has_value());
  EXPECT_EQ(storage->filter, Filter::kConstant);
  EXPECT_EQ(storage->codec, Codec::kNone);
  EXPECT_FALSE(storage_of({}).has_value());
}

}  // namespace
}  // namespace cairn::formats
