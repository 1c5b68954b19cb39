#include "formats/constant_size.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <type_traits>

namespace cairn::formats {
namespace {

TEST(ConstantSize, EverySizeIsPassedOnOnce) {
  for (std::size_t size = 0; size < 40; ++size) {
    std::size_t calls = 0, passed = 0;
    with_constant_size(size, [&](auto same) {
      ++calls;
      passed = same;
    });
    EXPECT_EQ(calls, 1U);
    EXPECT_EQ(passed, size);
  }
}

TEST(ConstantSize, UsualSizesAreConstants) {
  bool constant = false;
  const auto is_constant = [&]<typename Size>(Size) {
    constant = !std::is_same_v<Size, std::size_t>;
  };
  for (const std::size_t scalar : {1, 2, 4, 8}) {
    with_constant_size(scalar, is_constant);
    EXPECT_TRUE(constant) << scalar;
  }
  with_constant_size(255, is_constant);
  EXPECT_FALSE(constant);
}

}  // namespace
}  // namespace cairn::formats
