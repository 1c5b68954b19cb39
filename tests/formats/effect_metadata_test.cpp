#include "formats/dataset/effect_metadata.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/bytes.h"
#include "formats/dataset/index_file.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::formats {
namespace {

/// The tiny dataset keeps 43 points of 45.
class EffectMetadataTest : public testing::Test {
 protected:
  EffectMetadataTest() {
    test::TemporaryFolder folder;
    test::write_tiny_dataset(folder.path(), tree_);
    DatasetIndex index;
    EXPECT_FALSE(parse_index(test::read_file(folder / "index.bin"), index));
    extras_.levels.resize(tree_.header.tree().leaf_level() + 1);
    extras_.effects = {{.name = "thinning",
                        .removed = 1,
                        .digest = {.low = 7, .high = 1ULL << 63},
                        .balanced = ""},
                       {.name = "exposure", .removed = 0, .digest = {}, .balanced = "color"}};
    extras_.sources = {
        {.name = "a", .kept = 40, .removed = {1, 0}, .gains = {65536, 1, 98304}, .clamped = 5},
        {.name = "b",
         .kept = 3,
         .non_finite = 1,
         .removed = {0, 0},
         .gains = {65536, 65536, 65536}}};
    text_ = write_metadata(tree_.header, index.nodes, extras_);
  }

  /// The text with a value changed.
  std::string with(const char* pointer, const nlohmann::ordered_json& value) const {
    auto json = nlohmann::ordered_json::parse(text_);
    json[nlohmann::ordered_json::json_pointer(pointer)] = value;
    return json.dump();
  }

  test::TinyTree tree_ = test::make_tiny_tree(test::tiny_header());
  MetadataExtras extras_;
  std::string text_;
};

TEST_F(EffectMetadataTest, IsToldBySourceAndComesBack) {
  const auto json = nlohmann::json::parse(text_);
  EXPECT_EQ(json["effects"][0]["digest"], "80000000000000000000000000000007");
  EXPECT_EQ(json["sources"][0]["dropped"],
            (nlohmann::json{{"non_finite", 0}, {"no_return", 0}, {"thinning", 1}}));
  EXPECT_EQ(json["sources"][0]["balance"],
            (nlohmann::json{{"gain", {1.0, 1.0 / 65536, 1.5}}, {"clamped", 5}}));
  EXPECT_FALSE(check_metadata(text_, tree_.header));
  ToldEffects told;
  ASSERT_FALSE(read_metadata_effects(text_, told));
  EXPECT_EQ(told.removed, 1U);
  EXPECT_EQ(told.digest, extras_.effects[0].digest);
  EXPECT_EQ(told.balanced, "color");
  ASSERT_EQ(told.sources.size(), 2U);
  EXPECT_EQ(told.sources[0].gains, extras_.sources[0].gains);
}

TEST_F(EffectMetadataTest, CountsMustAddUp) {
  for (const char* count : {"/sources/0/kept", "/sources/1/dropped/non_finite",
                            "/sources/0/dropped/thinning", "/effects/0/removed"}) {
    EXPECT_TRUE(check_metadata(with(count, 2), tree_.header)) << count;
    EXPECT_TRUE(check_metadata(with(count, UINT64_MAX), tree_.header)) << count;
    EXPECT_TRUE(check_metadata(with(count, "many"), tree_.header)) << count;
  }
  EXPECT_TRUE(check_metadata(with("/sources/0/dropped", 1), tree_.header));
  EXPECT_TRUE(check_metadata(with("/effects", 1), tree_.header));
}

TEST_F(EffectMetadataTest, WhatCannotBeMeantIsRefused) {
  ToldEffects told;
  for (const auto& value : {nlohmann::ordered_json(0.3), nlohmann::ordered_json(-1),
                            nlohmann::ordered_json(65536.0), nlohmann::ordered_json("1")})
    EXPECT_TRUE(read_metadata_effects(with("/sources/0/balance/gain/0", value), told)) << value;
  for (const char* digest :
       {"", "80000000000000000000000000000g07", "+8000000000000000000000000000007"})
    EXPECT_TRUE(read_metadata_effects(with("/effects/0/digest", digest), told)) << digest;
  EXPECT_TRUE(read_metadata_effects(with("/effects/0/removed", -1), told));
  EXPECT_TRUE(read_metadata_effects(with("/effects", "all"), told));
  EXPECT_TRUE(read_metadata_effects("{", told));
  // Of datasets without effects there is nothing to tell.
  EXPECT_FALSE(read_metadata_effects("{}", told));
  EXPECT_EQ(told.removed, 0U);
  EXPECT_TRUE(told.sources.empty());
}

TEST(Gain, IsRoundedHalfUpAndClamped) {
  const Schema wide{{"intensity", ScalarType::kU16, 1, ReduceRule::kMean}};
  const auto column = balanced_column(wide);
  ASSERT_TRUE(column);
  EXPECT_EQ(column->offset, 12U);
  std::vector<std::byte> records(3 * 14);
  const std::uint16_t values[] = {1, 1000, 60000};
  for (std::size_t i = 0; i < 3; ++i) store_le(&records[14 * i + 12], values[i]);
  EXPECT_EQ(apply_gains(records, 14, *column, {98304}), 1U);  // 1.5
  const std::uint16_t expected[] = {2, 1500, 65535};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(load_le<std::uint16_t>(&records[14 * i + 12]), expected[i]);
}

TEST(Gain, IsOfColorBeforeIntensityAndOfWholeNumbersAlone) {
  const Attribute intensity{"intensity", ScalarType::kU16, 1, ReduceRule::kMean};
  const auto both = balanced_column({intensity, {"color", ScalarType::kU8, 3, ReduceRule::kMean}});
  ASSERT_TRUE(both);
  EXPECT_EQ(both->name, "color");
  EXPECT_EQ(both->offset, 14U);
  EXPECT_EQ(both->components, 3U);
  EXPECT_FALSE(balanced_column({}));
  EXPECT_FALSE(balanced_column({{"intensity", ScalarType::kF32, 1, ReduceRule::kMean}}));
}

}  // namespace
}  // namespace cairn::formats
