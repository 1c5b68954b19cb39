// PLY out: the header as it must read, the bytes as they must lie, and real scans read back.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/scan_writer.h"
#include "tests/support/las_bytes.h"
#include "tests/support/manifest.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::get_at;

const std::filesystem::path kShared = CAIRN_SHARED_DATA;

TEST(PlyWriter, HeaderAndRowsAreAsDescribed) {
  const test::TemporaryFolder folder;
  ScanInfo info;
  info.encoding = PositionEncoding::kSteps;
  info.scale = {0.5, 0.5, 0.5};
  info.offset = {100, 0, -1};
  PointBlock block;
  block.count = 1;
  block.steps = {{1, 2, 3}};
  test::add_column<std::uint8_t>(info, block, "color", ScalarType::kU8, {10, 20, 30});
  test::add_column<float>(info, block, "normal", ScalarType::kF32, {0, 0.6f, 0.8f});
  test::add_column<float>(info, block, "radius", ScalarType::kF32, {2.5f});
  test::add_column<std::int16_t>(info, block, "pair", ScalarType::kI16, {-1, -2});
  test::add_column<std::int64_t>(info, block, "id", ScalarType::kI64, {-9007199254740992});
  test::add_column<std::uint8_t>(info, block, "x", ScalarType::kU8, {5});
  const auto writer = create_scan_writer(folder / "out.ply", info, 1000);
  writer->write(block);
  writer->finish();
  const std::string bytes = test::read_text(folder / "out.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment written by cairn   \nelement vertex 1\n"
      "property double x\nproperty double y\nproperty double z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty float radius\n"
      "property short pair_0\nproperty short pair_1\nproperty double id\nproperty uchar x_2\n"
      "end_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  const std::string row = bytes.substr(header.size());
  ASSERT_EQ(row.size(), 24u + 3 + 12 + 4 + 4 + 8 + 1);
  EXPECT_EQ(get_at<double>(row, 0), 100.5);
  EXPECT_EQ(get_at<double>(row, 8), 1.0);
  EXPECT_EQ(get_at<double>(row, 16), 0.5);
  EXPECT_EQ(get_at<std::uint8_t>(row, 25), 20);
  EXPECT_EQ(get_at<float>(row, 31), 0.6f);
  EXPECT_EQ(get_at<float>(row, 39), 2.5f);
  EXPECT_EQ(get_at<std::int16_t>(row, 45), -2);
  EXPECT_EQ(get_at<double>(row, 47), -9007199254740992.0);
  EXPECT_EQ(get_at<std::uint8_t>(row, 55), 5);
}

TEST(PlyWriter, ACommentTellsTheCoordinateSystemAndIsTakenBack) {
  const test::TemporaryFolder folder;
  ScanInfo info;
  PointBlock block;
  block.count = 1;
  block.world = {{1, 2, 3}};
  for (const std::string text : {"EPSG:2994", "PROJCS[\"a, b  c\",GEOGCS[]]"}) {
    info.crs = crs_records(text).value();
    const auto writer = create_scan_writer(folder / "out.ply", info, 1, true);
    writer->write(block);
    writer->finish();
    EXPECT_NE(
        test::read_text(folder / "out.ply").find("\ncomment crs " + text + "\nelement vertex 1\n"),
        std::string::npos);
    EXPECT_EQ(test::read_points(folder / "out.ply").info.crs, info.crs);
  }
}

TEST(PlyWriter, RefusesIntegersThatADoubleDoesNotHold) {
  const test::TemporaryFolder folder;
  ScanInfo info;
  PointBlock block;
  block.count = 1;
  block.world = {{1, 2, 3}};
  test::add_column<std::uint64_t>(info, block, "id", ScalarType::kU64, {9007199254740993u});
  try {
    create_scan_writer(folder / "out.ply", info, 1)->write(block);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    EXPECT_NE(std::string(error.what()).find("id = 9007199254740993"), std::string::npos);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(PlyWriter, RefusesMorePropertiesThanTheReaderTakes) {
  const test::TemporaryFolder folder;
  ScanInfo info;
  for (int i = 0; i < 4; ++i)
    info.schema.push_back({"a" + std::to_string(i), ScalarType::kU8, 255, ReduceRule::kNone});
  PointBlock block;
  block.count = 1;
  block.world = {{1, 2, 3}};
  block.columns.assign(4, std::vector<std::byte>(255, std::byte{7}));
  {
    const auto writer = create_scan_writer(folder / "out.ply", info, 1);
    writer->write(block);
    writer->finish();
  }
  EXPECT_EQ(test::read_points(folder / "out.ply").info.schema.size(), 1020u);
  info.schema.push_back({"last", ScalarType::kU8, 1, ReduceRule::kNone});
  try {
    create_scan_writer(folder / "more.ply", info, 1);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "more.ply"));
}

TEST(PlyWriter, EveryRealPlyComesBackAsTheSamePoints) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = test::read_manifest(kShared / "MANIFEST.tsv");
  const test::TemporaryFolder folder;
  for (const auto& entry : entries) {
    if (!entry.path.ends_with(".ply") || entry.is_hostile()) continue;
    if (entry.path == "ply/sized_dims.ply") continue;  // has no z
    SCOPED_TRACE(entry.path);
    test::copy_scan(kShared / entry.path, folder / "out.ply");
    const auto before = test::read_points(kShared / entry.path);
    const auto after = test::read_points(folder / "out.ply");
    EXPECT_EQ(after.info.schema, before.info.schema);
    EXPECT_TRUE(after.records(before.names()) == before.records(before.names()));
  }
}

TEST(PlyWriter, LasAttributesKeepTheirNamesAndMeaning) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto path = kShared / "las/1.2-with-color.las";
  const test::TemporaryFolder folder;
  test::copy_scan(path, folder / "out.ply");
  const auto before = test::read_points(path);
  const auto after = test::read_points(folder / "out.ply");
  for (const Attribute& attribute : before.info.schema) {
    const auto index = find_attribute(after.info.schema, attribute.name);
    ASSERT_TRUE(index) << attribute.name;
    EXPECT_EQ(after.info.schema[*index], attribute) << attribute.name;
  }
  EXPECT_TRUE(after.records(before.names()) == before.records(before.names()));
}

}  // namespace
}  // namespace cairn::formats
