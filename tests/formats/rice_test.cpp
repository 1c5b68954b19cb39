#include "formats/dataset/rice.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace cairn::formats {
namespace {

template <typename U>
class RiceTest : public testing::Test {};
using Widths = testing::Types<std::uint8_t, std::uint16_t, std::uint32_t, std::uint64_t>;
TYPED_TEST_SUITE(RiceTest, Widths);

/// Values whose bit lengths spread around `bits`, with an outlier of all ones if asked.
template <typename U>
std::vector<U> values_of(std::size_t count, unsigned bits, bool outlier, std::mt19937_64& random) {
  std::vector<U> values(count);
  for (U& value : values) {
    const unsigned length = bits == 0 ? 0 : static_cast<unsigned>(random() % (bits + 1));
    value = length == 0 ? U{0} : static_cast<U>(random() >> (64 - length));
  }
  if (outlier) values[random() % count] = std::numeric_limits<U>::max();
  return values;
}

/// Size in bytes of the best code by the formula of rice.h, tried for every width.
template <typename U>
std::size_t best_size(const std::vector<U>& values) {
  std::size_t best = SIZE_MAX;
  for (unsigned width = 0; width <= static_cast<unsigned>(std::numeric_limits<U>::digits);
       ++width) {
    std::uint64_t quotients = 0;
    bool all_zero = true;
    for (const U value : values) {
      const std::uint64_t quotient = width >= 64 ? 0 : std::uint64_t{value} >> width;
      if (quotient >= 1024)
        quotients += 1'000'000;  // not used by the encoder
      else
        quotients += quotient;
      all_zero = all_zero && quotient == 0;
    }
    const std::size_t remainders = 1 + (values.size() * width + 7) / 8;
    best = std::min(best, remainders + (all_zero ? 0 : (values.size() + quotients + 7) / 8));
  }
  return best;
}

TYPED_TEST(RiceTest, RestoresBlocksOfEverySizeAtTheSmallestCost) {
  using U = TypeParam;
  std::mt19937_64 random(1);
  for (std::size_t count = 1; count <= kRiceBlock; ++count)
    for (unsigned bits = 0; bits <= static_cast<unsigned>(std::numeric_limits<U>::digits); ++bits)
      for (const bool outlier : {false, true}) {
        const auto values = values_of<U>(count, bits, outlier, random);
        std::vector<std::byte> coded;
        rice_encode(std::span<const U>(values), coded);
        ASSERT_LE(coded.size(), 1 + count * sizeof(U));
        ASSERT_EQ(coded.size(), best_size(values)) << count << " values of " << bits << " bits";
        coded.shrink_to_fit();
        std::vector<U> back(count);
        const auto used = rice_decode<U>(coded, back);
        ASSERT_TRUE(used.has_value());
        ASSERT_EQ(*used, coded.size());
        ASSERT_EQ(back, values) << count << " values of " << bits << " bits";
      }
}

TYPED_TEST(RiceTest, BlocksStandOneBehindTheOther) {
  using U = TypeParam;
  std::mt19937_64 random(2);
  std::vector<std::byte> coded;
  std::vector<std::vector<U>> blocks;
  for (unsigned i = 0; i < 50; ++i) {
    blocks.push_back(values_of<U>(1 + random() % kRiceBlock, i % 8, i % 5 == 0, random));
    rice_encode(std::span<const U>(blocks.back()), coded);
  }
  std::size_t at = 0;
  for (const auto& block : blocks) {
    std::vector<U> back(block.size());
    const auto used = rice_decode<U>(std::span<const std::byte>(coded).subspan(at), back);
    ASSERT_TRUE(used.has_value());
    ASSERT_EQ(back, block);
    at += *used;
  }
  EXPECT_EQ(at, coded.size());
}

TYPED_TEST(RiceTest, RefusesEveryTruncation) {
  using U = TypeParam;
  std::mt19937_64 random(3);
  for (unsigned bits = 1; bits <= static_cast<unsigned>(std::numeric_limits<U>::digits);
       bits += 3) {
    const auto values = values_of<U>(37, bits, false, random);
    std::vector<std::byte> coded;
    rice_encode(std::span<const U>(values), coded);
    for (std::size_t size = 0; size < coded.size(); ++size) {
      const std::vector<std::byte> part(coded.begin(),
                                        coded.begin() + static_cast<std::ptrdiff_t>(size));
      std::vector<U> back(37);
      ASSERT_FALSE(rice_decode<U>(part, back).has_value()) << size << " of " << coded.size();
    }
  }
}

TYPED_TEST(RiceTest, SurvivesEveryHeadAndNoise) {
  using U = TypeParam;
  std::mt19937_64 random(4);
  for (unsigned head = 0; head < 256; ++head)
    for (const std::size_t size : {1, 2, 9, 64, 600}) {
      std::vector<std::byte> noise(size);
      for (std::byte& b : noise) b = static_cast<std::byte>(random() % (head % 3 == 0 ? 2 : 256));
      noise[0] = static_cast<std::byte>(head);
      std::vector<U> back(1 + random() % kRiceBlock);
      const auto used = rice_decode<U>(noise, back);
      if (used) {
        ASSERT_LE(*used, noise.size());
      }
      const unsigned width = head & 0x7f;
      if (width > static_cast<unsigned>(std::numeric_limits<U>::digits)) {
        ASSERT_FALSE(used.has_value());
      }
    }
}

TEST(Rice, CostsLittleForWhatIsRegular) {
  const std::vector<std::uint32_t> zeros(64, 0);
  std::vector<std::byte> coded;
  rice_encode(std::span<const std::uint32_t>(zeros), coded);
  EXPECT_EQ(coded.size(), 1u);
  std::vector<std::uint32_t> steps(64);  // as a representative index: one step in four points
  for (std::size_t i = 0; i < 64; i += 4) steps[i] = 1;
  coded.clear();
  rice_encode(std::span<const std::uint32_t>(steps), coded);
  EXPECT_EQ(coded.size(), 1u + 8u);
}

}  // namespace
}  // namespace cairn::formats
