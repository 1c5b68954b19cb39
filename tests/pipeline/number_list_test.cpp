#include "pipeline/number_list.h"

#include <gtest/gtest.h>

namespace cairn::pipeline {
namespace {

using Numbers = std::vector<double>;

TEST(NumberList, IsReadWhole) {
  EXPECT_EQ(parse_numbers("1"), (Numbers{1}));
  EXPECT_EQ(parse_numbers("-123.5,44,1e3"), (Numbers{-123.5, 44, 1000}));
}

TEST(NumberList, AnythingElseIsNone) {
  for (const char* text :
       {"", ",", "1,", ",1", "1,,2", "1, 2", "1;2", "1,x", "1,2x", "nan", "1,inf", "1e999"})
    EXPECT_EQ(parse_numbers(text), Numbers{}) << text;
}

}  // namespace
}  // namespace cairn::pipeline
