#include "formats/dataset/metadata.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/dataset/index_file.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::formats {
namespace {

std::vector<NodeRecord> records_of(const test::TinyTree& tree) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), tree);
  DatasetIndex index;
  EXPECT_FALSE(parse_index(test::read_file(folder / "index.bin"), index));
  return index.nodes;
}

class MetadataTest : public testing::Test {
 protected:
  nlohmann::json write(MetadataExtras extras) {
    extras.levels.resize(tree_.header.tree().leaf_level() + 1);
    text_ = write_metadata(tree_.header, nodes_, extras);
    return nlohmann::json::parse(text_);
  }

  test::TinyTree tree_ = test::make_tiny_tree(test::tiny_header());
  std::vector<NodeRecord> nodes_ = records_of(tree_);
  std::string text_;
};

TEST_F(MetadataTest, TellsCountsTreeAndSchema) {
  const nlohmann::json json = write({});
  EXPECT_EQ(json["points"], 43);
  EXPECT_EQ(json["read"], 45);
  EXPECT_EQ(json["dropped"], 2);
  // 43 points for nodes of 10: log2(4.3) = 2.1, so 4 leaves on level 2 of 10 or 11 points.
  EXPECT_EQ(json["tree"]["levels"], 3);
  EXPECT_EQ(json["tree"]["nodes"], 7);
  EXPECT_EQ(json["tree"]["node_points"], 11);
  EXPECT_EQ(json["tree"]["leaf_points"], (nlohmann::json{{"min", 10}, {"max", 11}}));
  EXPECT_EQ(json["tree"]["inner_points"], (nlohmann::json{{"min", 11}, {"max", 11}}));
  EXPECT_EQ(json["schema"][3]["name"], "gps_time");
  EXPECT_EQ(json["schema"][3]["on_inner_nodes"], false);
  EXPECT_EQ(json["schema"][0]["type"], "float32");
  EXPECT_EQ(json["levels"].size(), 3u);
  EXPECT_EQ(json["levels"][2]["points"], 43);
  EXPECT_EQ(json["crs"]["wkt"], nullptr);
}

TEST_F(MetadataTest, BoundsAreWorldCoordinates) {
  const nlohmann::json json = write({});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(json["bounds"]["min"][axis], tree_.header.grid.world(nodes_[0].box.min)[axis]);
    EXPECT_EQ(json["bounds"]["max"][axis], tree_.header.grid.world(nodes_[0].box.max)[axis]);
  }
}

TEST_F(MetadataTest, CarriesSettingsSourcesAndCoordinateSystem) {
  const std::string wkt = "PROJCS[\"x\"]";
  VariableLengthRecord record{.user_id = "LASF_Projection", .record_id = 2112, .description = "d"};
  for (const char c : wkt + '\0') record.data.push_back(static_cast<std::byte>(c));
  const MetadataExtras extras{
      .parameters = {{"theta", "15.5"}, {"codec", "\"lzo\""}, {"grid", "null"}},
      .sources = {{.name = "a.las",
                   .format = "LAS 1.2",
                   .claimed = 10,
                   .kept = 6,
                   .non_finite = 1,
                   .no_return = 2,
                   .missing = 1,
                   .box = {{0, 0, 0}, {1, 2, 3}},
                   .crs = {0}}},
      .crs = {record}};
  const nlohmann::json json = write(extras);
  EXPECT_EQ(json["parameters"]["theta"], 15.5);
  EXPECT_EQ(json["parameters"]["grid"], nullptr);
  EXPECT_EQ(json["sources"][0]["kept"], 6);
  EXPECT_EQ(json["sources"][0]["dropped"]["non_finite"], 1);
  EXPECT_EQ(json["sources"][0]["dropped"]["no_return"], 2);
  EXPECT_EQ(json["sources"][0]["crs"], nlohmann::json::array({0}));
  EXPECT_EQ(json["crs"]["wkt"], wkt);
  std::vector<VariableLengthRecord> crs;
  ASSERT_FALSE(read_metadata_crs(text_, crs));
  EXPECT_EQ(crs, extras.crs);
}

TEST_F(MetadataTest, OneFileCarriesTheRecordsOfTheFirstSourceThatHasSome) {
  MetadataExtras extras;
  for (const std::uint16_t id : {2112, 34735, 34736})
    extras.crs.push_back({.user_id = "LASF_Projection", .record_id = id});
  extras.sources = {{.name = "none"}, {.name = "keys", .crs = {1, 2}}, {.name = "wkt", .crs = {0}}};
  write(extras);
  EXPECT_EQ(records_of_one_crs(text_, extras.crs), (std::vector{extras.crs[1], extras.crs[2]}));
  extras.sources.resize(1);  // as where the user gave them
  write(extras);
  EXPECT_EQ(records_of_one_crs(text_, extras.crs), extras.crs);
  EXPECT_EQ(records_of_one_crs(R"({"sources": [{"crs": [7]}]})", extras.crs), extras.crs);
  EXPECT_EQ(records_of_one_crs(R"({"sources": [{"crs": ["a"]}]})", extras.crs), extras.crs);
  EXPECT_EQ(records_of_one_crs("", extras.crs), extras.crs);
}

TEST_F(MetadataTest, DetailsOfExtraBytesComeBackBitByBit) {
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  const std::tuple<ScalarType, std::uint64_t, const char*> cases[] = {
      {ScalarType::kU64, UINT64_MAX, "18446744073709551615"},
      {ScalarType::kI16, static_cast<std::uint64_t>(std::int64_t{-9999}), "-9999"},
      {ScalarType::kF32, bits(-0.1), "-0.1"},
      {ScalarType::kF64, bits(-HUGE_VAL), "\"-inf\""},
      {ScalarType::kF64, bits(std::nan("")), "\"nan\""},
  };
  for (const auto& [type, no_data, text] : cases) {
    tree_.header.schema.back() = {.name = "height", .type = type};
    const AttributeDetails details{.attribute = "height",
                                   .name = "Height",
                                   .description = "above ground",
                                   .scale = 0.001,
                                   .offset = -1e5,
                                   .no_data = no_data};
    const nlohmann::json json = write({.details = {details}});
    EXPECT_EQ(json["schema"].back()["las"]["no_data"].dump(), text);
    EXPECT_EQ(json["schema"].back()["las"]["scale"], 0.001);
    EXPECT_EQ(read_metadata_details(text_), std::vector{details});
  }
  write({});
  EXPECT_TRUE(read_metadata_details(text_).empty());
}

TEST_F(MetadataTest, BitsOfColorsAreToldWhereTheyAreFewer) {
  EXPECT_EQ(write({.color_bits = 8})["schema"][1]["bits"], 8);
  EXPECT_EQ(read_metadata_color_bits(text_), 8U);
  EXPECT_FALSE(write({})["schema"][1].contains("bits"));
  EXPECT_EQ(read_metadata_color_bits(text_), std::nullopt);
}

TEST_F(MetadataTest, HostileDetailsAreNone) {
  for (const char* text :
       {"", "[]", "{}", R"({"schema": 5})", R"({"schema": [5, {"las": 5}]})",
        R"({"schema": [{"name": "a", "type": "uint8", "las": {"name": 7}}]})",
        R"({"schema": [{"name": "a", "type": "no type", "las": {"name": "A"}}]})",
        R"({"schema": [{"name": "color", "bits": 99}]})",
        R"({"schema": [{"name": "color", "bits": "8"}]})"}) {
    EXPECT_TRUE(read_metadata_details(text).empty()) << text;
    EXPECT_FALSE(read_metadata_color_bits(text)) << text;
  }
}

TEST_F(MetadataTest, CoordinateSystemBytesOfAnyLengthComeBack) {
  MetadataExtras extras;
  for (int size = 0; size < 8; ++size) {
    VariableLengthRecord record{.user_id = "u", .record_id = 34735};
    for (int i = 0; i < size; ++i) record.data.push_back(static_cast<std::byte>(251 - 40 * i));
    extras.crs.push_back(record);
  }
  write(extras);
  std::vector<VariableLengthRecord> crs;
  ASSERT_FALSE(read_metadata_crs(text_, crs));
  EXPECT_EQ(crs, extras.crs);
}

TEST_F(MetadataTest, NamesThatAreNotUtf8StayJson) {
  MetadataExtras extras;
  extras.sources = {{.name = "\xff\xfe.las", .format = "\x80"}};
  EXPECT_NO_THROW(write(extras));
}

TEST_F(MetadataTest, RefusesASettingThatIsNotJson) {
  MetadataExtras extras;
  extras.parameters = {{"codec", "lzo"}};
  EXPECT_THROW(write(extras), Error);
}

TEST_F(MetadataTest, NumbersThatNothingHoldsAreRefused) {
  std::vector<VariableLengthRecord> crs;
  EXPECT_TRUE(check_metadata(R"({"x":1e999})", tree_.header));
  EXPECT_TRUE(read_metadata_crs(R"({"x":1e999})", crs));
  EXPECT_TRUE(check_metadata_text(R"({"x":1e999})"));
  EXPECT_TRUE(check_metadata_text(R"({"x":)"));
  EXPECT_TRUE(check_metadata_text("[1]"));
  EXPECT_TRUE(check_metadata_text("{\"x\":\"\xff\"}"));
  EXPECT_FALSE(check_metadata_text(R"({"x":1e300})"));
}

TEST_F(MetadataTest, NestingIsBounded) {
  const auto nested = [](std::size_t depth) {
    return R"({"x":)" + std::string(depth, '[') + std::string(depth, ']') + "}";
  };
  EXPECT_FALSE(check_metadata_text(nested(64)));
  std::vector<VariableLengthRecord> crs;
  for (const std::size_t depth : {65U, 1'000'000U}) {
    const auto error = check_metadata_text(nested(depth));
    ASSERT_TRUE(error);
    EXPECT_EQ(error->what, "the metadata is nested too deeply");
    EXPECT_TRUE(check_metadata(nested(depth), tree_.header));
    EXPECT_TRUE(read_metadata_crs(nested(depth), crs));
  }
}

TEST_F(MetadataTest, RecordIdsBeyondTheirTypeAreRefused) {
  const auto read = [](const std::string& id) {
    std::vector<VariableLengthRecord> crs;
    const bool refused = read_metadata_crs(R"({"crs":{"records":[{"user_id":"u","record_id":)" +
                                               id + R"(,"description":"","data_base64":""}]}})",
                                           crs)
                             .has_value();
    return refused ? -1 : int{crs.at(0).record_id};
  };
  EXPECT_EQ(read("65535"), 65535);
  for (const char* id :
       {"65536", "70000", "-1", "1.5", "1e3", "null", "\"7\"", "18446744073709551616"})
    EXPECT_EQ(read(id), -1) << id;
}

TEST_F(MetadataTest, ContradictionsToTheIndexAreNamed) {
  write({});
  EXPECT_FALSE(check_metadata(text_, tree_.header));
  DatasetHeader other = tree_.header;
  other.dropped_points = 3;
  const auto error = check_metadata(text_, other);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "the metadata contradicts the index: dropped");
  EXPECT_EQ(error->found, "2");
  EXPECT_EQ(error->expected, "3");
  EXPECT_TRUE(check_metadata("{", tree_.header));
  EXPECT_TRUE(check_metadata("[]", tree_.header));
  EXPECT_TRUE(check_metadata("", tree_.header));
}

}  // namespace
}  // namespace cairn::formats
