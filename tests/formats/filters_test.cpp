#include "formats/dataset/filters.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "formats/dataset/normal_map.h"
#include "tests/support/columns.h"

namespace cairn::formats {
namespace {

using tests::Bytes;
using tests::Content;
using tests::make_column;

constexpr std::array kFilters{Filter::kPlain, Filter::kConstant, Filter::kRuns, Filter::kPlanes,
                              Filter::kRice};
constexpr std::size_t kCounts[] = {0, 1, 2, 31, 32, 33, 64, 65, 300};

/// Decodes into an allocation of exactly the column's size, from one of exactly the filtered size.
std::optional<DecodeError> undo_exactly(Filter filter, const Bytes& filtered,
                                        const ColumnShape& shape, Bytes& column) {
  const Bytes input(filtered);
  column.assign(shape.size_bytes(), std::byte{0xa5});
  column.shrink_to_fit();
  return undo_filter(filter, input, shape, column);
}

void expect_round_trip(Filter filter, const LanePlan& plan, const Bytes& column,
                       const ColumnShape& shape) {
  Bytes filtered;
  if (!apply_filter(filter, plan, column, shape, filtered)) {
    EXPECT_TRUE(filtered.empty());
    return;
  }
  EXPECT_LE(filtered.size(), filtered_size_limit(shape));
  Bytes back;
  const auto error = undo_exactly(filter, filtered, shape, back);
  ASSERT_FALSE(error.has_value()) << "filter " << static_cast<int>(filter) << ": " << error->what;
  ASSERT_EQ(back, column) << "filter " << static_cast<int>(filter) << ", " << shape.count
                          << " points of " << shape.components << ' ' << name_of(shape.type);
}

/// All plans that fit a shape; the factor divides every value of `column`.
std::vector<LanePlan> plans_for(const Bytes& column, const ColumnShape& shape) {
  std::vector<LanePlan> plans;
  const std::uint64_t factor = choose_plan(column, shape).factor;
  for (unsigned flags = 0; flags <= LanePlan::kAllFlags; ++flags) {
    const LanePlan plan{static_cast<std::uint8_t>(flags), factor};
    if (plan_fits(plan, shape)) plans.push_back(plan);
  }
  return plans;
}

TEST(Filters, AreKnownByTheirValues) {
  for (const Filter filter : kFilters)
    EXPECT_EQ(filter_of(static_cast<std::uint8_t>(filter)), filter);
  EXPECT_FALSE(filter_of(5).has_value());
}

TEST(Filters, EveryPlanRestoresEveryKindOfColumn) {
  for (const ScalarType type : tests::kAllTypes)
    for (const std::uint32_t components : {1u, 2u, 3u, 29u, 255u})
      for (const std::size_t count : kCounts)
        for (const Content content : tests::kAllContents) {
          const ColumnShape shape{type, components, count};
          const Bytes column = make_column(shape, content);
          for (const Filter filter : {Filter::kPlain, Filter::kConstant, Filter::kRuns})
            expect_round_trip(filter, {}, column, shape);
          if (components > 3 && count > 65) continue;
          for (const LanePlan& plan : plans_for(column, shape)) {
            expect_round_trip(Filter::kPlanes, plan, column, shape);
            expect_round_trip(Filter::kRice, plan, column, shape);
          }
        }
}

TEST(Filters, ConstantAppliesToConstantsAlone) {
  const ColumnShape shape{ScalarType::kU16, 3, 100};
  Bytes column = make_column(shape, Content::kConstant);
  Bytes filtered;
  EXPECT_TRUE(apply_filter(Filter::kConstant, {}, column, shape, filtered));
  EXPECT_EQ(filtered.size(), 6u);
  column.back() ^= std::byte{1};
  EXPECT_FALSE(apply_filter(Filter::kConstant, {}, column, shape, filtered));
}

TEST(Filters, RunsOfAnyLength) {
  for (const std::size_t length : {1, 2, 255, 256, 257, 512, 513, 1000}) {
    const ColumnShape shape{ScalarType::kU32, 1, 3 * length};
    std::vector<std::uint32_t> values(3 * length);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<std::uint32_t>(i / length);
    expect_round_trip(Filter::kRuns, {}, tests::bytes_of(values), shape);
  }
}

TEST(Filters, PlanFindsEightBitColourInWideFields) {
  for (const unsigned factor : {256u, 257u}) {
    std::mt19937 random(1);
    std::vector<std::uint16_t> colour(300);
    for (auto& c : colour) c = static_cast<std::uint16_t>(random() % 256 * factor);
    const auto plan = choose_plan(tests::bytes_of(colour), {ScalarType::kU16, 3, 100});
    EXPECT_TRUE(plan.has(LanePlan::kFactor));
    EXPECT_EQ(plan.factor, factor);
  }
}

TEST(Filters, PlanFindsCorrelatedColour) {
  std::mt19937 random(2);
  std::vector<std::uint8_t> colour;
  for (int i = 0; i < 500; ++i) {
    const unsigned grey = random() % 200;
    for (int c = 0; c < 3; ++c) colour.push_back(static_cast<std::uint8_t>(grey + random() % 4));
  }
  EXPECT_TRUE(choose_plan(tests::bytes_of(colour), {ScalarType::kU8, 3, 500})
                  .has(LanePlan::kGreenDifference));
}

TEST(Filters, PlanFindsNormalCodes) {
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < 2000; ++i) {
    const float t = static_cast<float>(i) * 0.003f;
    codes.push_back(encode_normal({std::cos(t), std::sin(t * 1.3f), 0.4f}));
  }
  const Bytes column = tests::bytes_of(codes);
  const ColumnShape shape{ScalarType::kU16, 1, codes.size()};
  const LanePlan plan = choose_plan(column, shape);
  EXPECT_TRUE(plan.has(LanePlan::kCubeDigits));
  expect_round_trip(Filter::kRice, plan, column, shape);
}

TEST(Filters, PlanFindsMonotoneIndices) {
  std::vector<std::uint32_t> indices(1000);
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::uint32_t>(i / 4);
  const Bytes column = tests::bytes_of(indices);
  const ColumnShape shape{ScalarType::kU32, 1, indices.size()};
  const LanePlan plan = choose_plan(column, shape);
  EXPECT_TRUE(plan.has(LanePlan::kMonotone));
  Bytes filtered;
  ASSERT_TRUE(apply_filter(Filter::kRice, plan, column, shape, filtered));
  EXPECT_LE(filtered.size(),
            indices.size() / 8 + indices.size() / 64 + 4);  // a bit a point, a head a block
}

TEST(Filters, PlanLeavesNoiseAsItIs) {
  const ColumnShape shape{ScalarType::kU8, 1, 1000};
  EXPECT_TRUE(choose_plan(make_column(shape, Content::kSmall), shape).has(LanePlan::kAbsolute));
}

TEST(Filters, RefuseEveryTruncationAndExtension) {
  const ColumnShape shape{ScalarType::kU16, 3, 70};
  for (const Content content : {Content::kConstant, Content::kWalk, Content::kRuns}) {
    const Bytes column = make_column(shape, content);
    for (const Filter filter : kFilters) {
      Bytes filtered;
      if (!apply_filter(filter, choose_plan(column, shape), column, shape, filtered)) continue;
      Bytes back;
      for (std::size_t size = 0; size < filtered.size(); ++size)
        ASSERT_TRUE(undo_exactly(
            filter, Bytes(filtered.begin(), filtered.begin() + static_cast<std::ptrdiff_t>(size)),
            shape, back))
            << "filter " << static_cast<int>(filter) << ' ' << size;
      filtered.push_back(std::byte{0});
      ASSERT_TRUE(undo_exactly(filter, filtered, shape, back))
          << "filter " << static_cast<int>(filter);
    }
  }
}

TEST(Filters, SurviveEveryFlippedBit) {
  for (const ColumnShape shape :
       {ColumnShape{ScalarType::kU16, 3, 70}, ColumnShape{ScalarType::kU16, 1, 70},
        ColumnShape{ScalarType::kF64, 1, 66}, ColumnShape{ScalarType::kU8, 1, 64}})
    for (const Content content :
         {Content::kConstant, Content::kWalk, Content::kRuns, Content::kScaled}) {
      const Bytes column = make_column(shape, content);
      for (const Filter filter : kFilters) {
        Bytes filtered;
        if (!apply_filter(filter, choose_plan(column, shape), column, shape, filtered)) continue;
        Bytes back;
        for (std::size_t bit = 0; bit < filtered.size() * 8; ++bit) {
          filtered[bit / 8] ^= std::byte{1} << (bit % 8);
          static_cast<void>(undo_exactly(filter, filtered, shape, back));
          filtered[bit / 8] ^= std::byte{1} << (bit % 8);
        }
      }
    }
}

TEST(Filters, ErrorsNameOffsetFoundAndExpected) {
  const ColumnShape shape{ScalarType::kU8, 1, 10};
  // Two runs of 4 and 7 points in a column of 10.
  const std::vector<std::uint8_t> runs{2, 0, 0, 0, 3, 6, 50, 51};
  Bytes back;
  const auto error = undo_exactly(Filter::kRuns, tests::bytes_of(runs), shape, back);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->byte_offset, 5u);
  EXPECT_EQ(error->found, "7");
  EXPECT_EQ(error->expected, "6");
  // A count of runs that would need 8 GB.
  const std::vector<std::uint8_t> many{255, 255, 255, 255, 0, 0};
  EXPECT_TRUE(undo_exactly(Filter::kRuns, tests::bytes_of(many), shape, back).has_value());
}

}  // namespace
}  // namespace cairn::formats
