#include "stages/filter/filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "formats/dataset/digest.h"
#include "tests/support/dying_log.h"
#include "tests/support/filter_campaign.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;
using test::ColoredCampaign;
using test::ColoredPoint;
using test::FilteredCampaign;

class FilterTest : public test::FilterFixture {};

/// Those of equal keys that come first.
template <typename Key>
ColoredCampaign first_of_each(const ColoredCampaign& points, Key key) {
  std::set<decltype(key(points.front()))> seen;
  ColoredCampaign first;
  for (const ColoredPoint& p : points)
    if (seen.insert(key(p)).second) first.push_back(p);
  std::sort(first.begin(), first.end());
  return first;
}

void expect_counted_by_source(const FilteredCampaign& result, const ColoredCampaign& given) {
  std::map<std::uint32_t, std::uint64_t> all, kept;
  for (const ColoredPoint& p : given) ++all[p.scan];
  for (const ColoredPoint& p : result.points) ++kept[p.scan];
  for (std::size_t s = 0; s < result.filtered.sources.size(); ++s) {
    const SourceOutcome& source = result.filtered.sources[s];
    const auto scan = static_cast<std::uint32_t>(s);
    EXPECT_EQ(source.kept, kept[scan]);
    EXPECT_EQ(source.removed[0], all[scan] - kept[scan]);
  }
  EXPECT_EQ(result.filtered.points, result.points.size());
  EXPECT_EQ(result.filtered.effects[0].removed, given.size() - result.points.size());
}

TEST_F(FilterTest, OfPointsOfOnePositionTheFirstOfTheCampaignIsKept) {
  for (const std::uint32_t range : {8U, 40U, 1U << 20}) {
    const ColoredCampaign points = test::random_campaign(3, 1500, range, range);
    const auto expected = first_of_each(points, [](const ColoredPoint& p) { return p.position; });
    for (const std::uint64_t node_points : {20U, 300U, 10000U}) {
      const auto result = run(points, {.duplicates = Duplicates::kPosition}, node_points);
      EXPECT_EQ(result.points, expected) << range << " " << node_points;
      expect_counted_by_source(result, points);
    }
  }
}

TEST_F(FilterTest, ExactDuplicatesAgreeInAllAttributesToo) {
  ColoredCampaign points = test::random_campaign(2, 2000, 6, 3);
  for (ColoredPoint& p : points) {
    p.number %= 3;
    for (auto& channel : p.color) channel %= 2;
  }
  const auto expected = first_of_each(
      points, [](const ColoredPoint& p) { return std::tuple(p.position, p.number, p.color); });
  const auto result = run(points, {.duplicates = Duplicates::kExact}, 50);
  EXPECT_EQ(result.points, expected);
  expect_counted_by_source(result, points);
}

TEST_F(FilterTest, ManyCopiesAreOnePoint) {
  const ColoredCampaign points(200'000, ColoredPoint{{5, 6, 7}, 9, {}, 0});
  const auto result = run(points, {.duplicates = Duplicates::kPosition}, 2'000);
  EXPECT_EQ(result.points, (ColoredCampaign{points.front()}));
}

TEST_F(FilterTest, ThinningKeepsThePointNearestToTheCenterOfEachCell) {
  for (const double side : {7.5, 64.0, 1000.0}) {
    const ColoredCampaign points = test::random_campaign(3, 1500, 200, 5);
    std::map<GridPoint, std::tuple<double, GridPoint, std::uint32_t>> best;
    for (const ColoredPoint& p : points) {
      GridPoint cell;
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        cell[axis] = static_cast<std::int32_t>(std::floor(p.position[axis] / side));
        squared += std::pow(p.position[axis] - (cell[axis] + 0.5) * side, 2);
      }
      const auto candidate = std::tuple(squared, p.position, p.number);
      const auto [known, is_new] = best.emplace(cell, candidate);
      if (!is_new) known->second = std::min(known->second, candidate);
    }
    std::vector<std::uint32_t> expected;
    for (const auto& [cell, candidate] : best) expected.push_back(std::get<2>(candidate));
    std::sort(expected.begin(), expected.end());
    for (const std::uint64_t node_points : {20U, 400U, 10000U}) {
      const auto result = run(points, {.thin = side}, node_points);
      EXPECT_EQ(result.numbers(), expected) << side << " " << node_points;
      expect_counted_by_source(result, points);
    }
  }
}

TEST_F(FilterTest, ThinningToLessThanAStepKeepsOnePointAPosition) {
  const ColoredCampaign points = test::random_campaign(1, 3000, 9, 6);
  const auto expected = first_of_each(points, [](const ColoredPoint& p) { return p.position; });
  EXPECT_EQ(run(points, {.thin = 1e-300}, 100).points, expected);
}

TEST_F(FilterTest, WithoutNumbersRecordsAreTheContent) {
  const ColoredCampaign points = test::random_campaign(2, 300, 20, 7);
  const auto with = run(points, {.thin = 3}, 40, true),
             without = run(points, {.thin = 3}, 40, false);
  EXPECT_EQ(without.filtered.stride, kContentBytes);
  EXPECT_EQ(without.numbers(), with.numbers());
}

FilterOptions all_effects() {
  return {.duplicates = Duplicates::kPosition,
          .outlier_deviations = 1.5,
          .outlier_neighbors = 6,
          .balance_exposure = true,
          .thin = 4};
}

/// In the order in which the effects act, counted once each.
TEST_F(FilterTest, KeptAndRemovedTogetherAreTheInput) {
  const ColoredCampaign points = test::random_campaign(3, 2000, 40, 8);
  const auto result = run(points, all_effects(), 100);
  const FilteredPoints& filtered = result.filtered;
  EXPECT_THAT(filtered.names,
              ::testing::ElementsAre("duplicates", "outliers", "exposure", "thinning"));
  for (const std::size_t effect : {0U, 1U, 3U}) EXPECT_GT(filtered.effects[effect].removed, 0U);
  EXPECT_EQ(filtered.effects[2].removed, 0U);

  std::uint64_t sum = filtered.points;
  formats::Digest digest = formats::digest_of(result.bytes, filtered.stride, kContentBytes);
  for (const EffectOutcome& effect : filtered.effects) {
    sum += effect.removed;
    digest += effect.digest;
  }
  EXPECT_EQ(sum, points.size());
  formats::Digest of_input;
  for (const ColoredPoint& p : points) {  // the least coordinate is 0, as is the grid's origin
    std::array<std::byte, kContentBytes> record;
    std::memcpy(record.data(), p.position.data(), 12);
    std::memcpy(record.data() + 12, &p.number, 4);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint64_t gain = filtered.sources[p.scan].gain[c];
      const auto gained = static_cast<std::uint16_t>(
          std::min<std::uint64_t>(65535, (p.color[c] * gain + 32768) / 65536));
      std::memcpy(record.data() + 16 + 2 * c, &gained, 2);
    }
    of_input += formats::digest_of(record, record.size());
  }
  EXPECT_EQ(digest, of_input);
}

TEST_F(FilterTest, SameBytesFromAnyThreadsAndWithTinyMemory) {
  const ColoredCampaign points = test::random_campaign(3, 8000, 60, 9);
  const auto with = [&](unsigned threads, std::uint64_t memory) {
    context().threads = threads;
    context().memory_bytes = memory;
    return run(points, all_effects(), 150).bytes;
  };
  const auto one = with(1, std::uint64_t{1} << 30);
  EXPECT_EQ(with(2, std::uint64_t{1} << 30), one);
  EXPECT_EQ(with(7, std::uint64_t{1} << 20), one);
}

TEST_F(FilterTest, WhatIsKeptDoesNotDependOnHowPointsAreDivided) {
  const ColoredCampaign points = test::random_campaign(2, 4000, 50, 10);
  FilterOptions options = all_effects();
  options.balance_exposure = false;
  EXPECT_EQ(run(points, options, 30).points, run(points, options, 8000).points);
}

TEST_F(FilterTest, GoesOnFromWhatAnEarlierRunHasLeft) {
  const ColoredCampaign points = test::random_campaign(2, 1000, 20, 11);
  const auto place = folder().path();
  test::DyingLog log;
  const auto undisturbed = run(points, all_effects(), 100);
  context().units = &log;
  context().make_array = [=](std::string_view name, std::uint64_t size_bytes) {
    std::filesystem::remove(place / name);
    return formats::ExternalArray(place / name, size_bytes);
  };
  context().find_array = [=](std::string_view name, std::uint64_t size_bytes) {
    return formats::ExternalArray::find(place / name, size_bytes);
  };
  const FilterInput nothing = [&] {
    static formats::ExternalArray empty;
    static const formats::Grid grid;
    static const formats::Tree tree(points.size(), 3, 100);
    static const formats::Schema schema{
        {"color", formats::ScalarType::kU16, 3, formats::ReduceRule::kMean}};
    return FilterInput{empty, 26, true, true, grid, tree, schema, 2};
  }();
  EXPECT_THROW(filter(nothing, all_effects(), context()), WorkLost);
  EXPECT_EQ(run(points, all_effects(), 100).bytes, undisturbed.bytes);
  // All is done: the records that it was made of are not needed any more.
  const FilteredPoints again = filter(nothing, all_effects(), context());
  EXPECT_TRUE(std::ranges::equal(std::as_const(again.array).bytes(), undisturbed.bytes));
  EXPECT_EQ(again.sources[1].removed, undisturbed.filtered.sources[1].removed);
  EXPECT_EQ(again.effects[3].digest, undisturbed.filtered.effects[3].digest);
  // Damaged records are none.
  {
    auto array = context().find_array("filter", undisturbed.bytes.size());
    array->bytes()[100] ^= std::byte{1};
  }
  const FilteredPoints damaged = filter(nothing, all_effects(), context());
  EXPECT_EQ(damaged.array.size_bytes(), 0U);
  EXPECT_EQ(damaged.points, undisturbed.filtered.points);
}

}  // namespace
}  // namespace cairn::stages
