#include "stages/export.h"

#include <gtest/gtest.h>

#include <cmath>

#include "formats/bytes.h"
#include "formats/error.h"
#include "tests/support/scan_points.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::PointBlock;
using formats::PositionEncoding;
using formats::ScanInfo;

/// Keeps what it is given.
struct Collector final : formats::ScanWriter {
  void write(const PointBlock& block) override { blocks.push_back(block); }
  void finish() override {}
  std::vector<PointBlock> blocks;
};

/// All points of a scan, however they are encoded.
struct Points {
  std::vector<formats::WorldPoint> world;
  std::vector<std::vector<std::byte>> columns;
};

void append(const ScanInfo& info, const PointBlock& block, Points& points) {
  for (std::size_t i = 0; i < block.count; ++i) {
    if (info.encoding != PositionEncoding::kSteps) {
      points.world.push_back(block.world[i]);
      continue;
    }
    formats::WorldPoint p;
    for (std::size_t a = 0; a < 3; ++a) p[a] = info.offset[a] + info.scale[a] * block.steps[i][a];
    points.world.push_back(p);
  }
  points.columns.resize(info.schema.size());
  for (std::size_t c = 0; c < info.schema.size(); ++c)
    points.columns[c].insert(points.columns[c].end(), block.columns[c].begin(),
                             block.columns[c].end());
}

class ExportTest : public testing::Test {
 protected:
  void build(const formats::DatasetHeader& header) {
    tree_ = test::make_tiny_tree(header);
    test::write_tiny_dataset(folder_.path(), tree_);
  }
  /// Exports to a file and reads it back with the project's reader of that format.
  Points export_to(const char* name, Level level, bool steps) {
    const DatasetReader dataset = DatasetReader::open(folder_.path());
    const ScanInfo info = describe_export(dataset, level_selection(dataset, level), steps);
    auto writer = formats::create_scan_writer(folder_ / name, info, info.present_points);
    EXPECT_EQ(export_points(test::plain_context(), dataset, level_selection(dataset, level), info,
                            *writer),
              info.present_points);
    writer->finish();
    const auto reader = test::open_scan(folder_ / name, {});
    back_ = reader->info();
    Points points;
    for (std::size_t s = 0; s < reader->stretch_count(); ++s)
      reader->read(s, [&](const PointBlock& block) { append(reader->info(), block, points); });
    return points;
  }

  test::TinyTree tree_;
  test::TemporaryFolder folder_;
  ScanInfo back_;
};

TEST_F(ExportTest, LeavesAreTheInputInPly) {
  build(test::tiny_header());
  const Points points = export_to("out.ply", 2, false);
  ASSERT_EQ(points.world.size(), 43u);
  std::size_t at = 0;
  for (std::uint64_t id = 3; id < 7; ++id)
    for (const formats::GridPoint& p : tree_.nodes[id].points.position)
      EXPECT_EQ(points.world[at++], tree_.header.grid.world(p));
  EXPECT_FALSE(formats::find_attribute(back_.schema, "radius"));
  const auto color = formats::find_attribute(back_.schema, "color");
  ASSERT_TRUE(color);
  EXPECT_EQ(points.columns[*color][3], tree_.nodes[3].points.attributes[1][3]);
}

TEST_F(ExportTest, LasGetsItsIntegersBack) {
  build(test::tiny_header());
  const Points points = export_to("out.las", 2, true);
  EXPECT_EQ(back_.scale, tree_.header.grid.step);
  EXPECT_EQ(back_.offset, tree_.header.grid.offset);
  ASSERT_EQ(points.world.size(), 43u);
  for (std::size_t i = 0; i < tree_.nodes[3].points.count(); ++i)
    EXPECT_EQ(points.world[i], tree_.header.grid.world(tree_.nodes[3].points.position[i]));
}

TEST_F(ExportTest, AShiftBeyondInt32GoesIntoTheOffset) {
  formats::DatasetHeader header = test::tiny_header();
  header.grid = {
      .step = {0.25, 0.25, 0.25}, .offset = {1, 2, 3}, .shift = {std::int64_t{1} << 40, 0, -5}};
  build(header);
  const DatasetReader dataset = DatasetReader::open(folder_.path());
  const ScanInfo info = describe_export(dataset, level_selection(dataset, 2), true);
  EXPECT_EQ(info.offset, (std::array<double, 3>{1 + 0.25 * std::ldexp(1, 40), 2, 3 - 1.25}));
  Collector collector;
  export_points(test::plain_context(), dataset, level_selection(dataset, 2), info, collector);
  EXPECT_EQ(collector.blocks[0].steps[1], tree_.nodes[3].points.position[1]);
}

TEST_F(ExportTest, InnerLevelsCarryRadiusAndWeight) {
  build(test::tiny_header());
  const Points points = export_to("out.ply", 1, false);
  ASSERT_EQ(points.world.size(), 22u);
  EXPECT_FALSE(formats::find_attribute(back_.schema, "gps_time"));
  const auto weight = formats::find_attribute(back_.schema, "weight");
  const auto radius = formats::find_attribute(back_.schema, "radius");
  ASSERT_TRUE(weight && radius);
  EXPECT_EQ(back_.schema[*weight].type, formats::ScalarType::kF64);  // PLY has no 64-bit integers
  double sum = 0;
  for (std::size_t i = 0; i < 22; ++i)
    sum += formats::load_le<double>(&points.columns[*weight][8 * i]);
  EXPECT_EQ(sum, 43);
}

TEST_F(ExportTest, AnInputAttributeCalledWeightIsNotTakenForTheWeight) {
  for (const auto rule : {formats::ReduceRule::kNone, formats::ReduceRule::kMean}) {
    formats::DatasetHeader header = test::tiny_header();
    for (formats::Attribute& attribute : header.schema)
      if (attribute.name == (rule == formats::ReduceRule::kNone ? "gps_time" : "color"))
        attribute.name = "weight";
    build(header);
    Collector collector;
    const DatasetReader dataset = DatasetReader::open(folder_.path());
    const ScanInfo info = describe_export(dataset, level_selection(dataset, 1), false);
    export_points(test::plain_context(), dataset, level_selection(dataset, 1), info, collector);
    const auto own = formats::find_attribute(info.schema, "weight_");
    ASSERT_TRUE(own);
    EXPECT_EQ(formats::find_attribute(info.schema, "weight").has_value(),
              rule == formats::ReduceRule::kMean);
    std::uint64_t sum = 0;
    for (const PointBlock& block : collector.blocks)
      for (std::size_t i = 0; i < block.count; ++i)
        sum += formats::load_le<std::uint64_t>(&block.columns[*own][8 * i]);
    EXPECT_EQ(sum, 43u);
  }
}

TEST_F(ExportTest, AMixedCutStandsForEachPointOnce) {
  build(test::tiny_header());
  const DatasetReader dataset = DatasetReader::open(folder_.path());
  // The root's block for its second child, the first child's block for its first, and its second child: leaf 4.
  const ExportSelection cut{
      .nodes = {{formats::NodeId{0}, 2}, {formats::NodeId{1}, 1}, {formats::NodeId{4}, 1}},
      .box = {}};
  const ScanInfo info = describe_export(dataset, cut, true);
  EXPECT_FALSE(formats::find_attribute(info.schema, "gps_time"));
  EXPECT_EQ(left_out_attributes(dataset, cut), std::vector<std::string>{"gps_time"});
  Collector collector;
  const std::uint64_t written = export_points(test::plain_context(), dataset, cut, info, collector);
  EXPECT_EQ(written, info.claimed_points);
  const auto weight = formats::find_attribute(info.schema, "weight");
  ASSERT_TRUE(weight);
  std::uint64_t sum = 0, seen = 0;
  for (const PointBlock& block : collector.blocks)
    for (std::size_t i = 0; i < block.count; ++i, ++seen)
      sum += formats::load_le<std::uint64_t>(&block.columns[*weight][8 * i]);
  EXPECT_EQ(sum, 43U);  // all input points
  EXPECT_EQ(seen, written);
  // The leaf comes last, with the input's own points, each standing for itself.
  const auto& leaf = tree_.nodes[4].points;
  const PointBlock& last = collector.blocks.back();
  ASSERT_EQ(last.count, leaf.count());
  for (std::size_t i = 0; i < last.count; ++i) {
    EXPECT_EQ(formats::load_le<std::uint64_t>(&last.columns[*weight][8 * i]), 1U);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_EQ(last.steps[i][axis], leaf.position[i][axis] + tree_.header.grid.shift[axis]);
  }
}

TEST_F(ExportTest, ABoxTakesThePointsInsideIt) {
  build(test::tiny_header());
  const DatasetReader dataset = DatasetReader::open(folder_.path());
  for (const Level level : {0U, 1U, 2U}) {
    std::vector<formats::WorldPoint> all;
    const ExportSelection whole = level_selection(dataset, level);
    Collector collector;
    const ScanInfo info = describe_export(dataset, whole, false);
    export_points(test::plain_context(), dataset, whole, info, collector);
    for (const PointBlock& block : collector.blocks)
      all.insert(all.end(), block.world.begin(), block.world.end());
    // From one point to another, ends included.
    for (std::size_t corner = 1; corner < all.size(); corner += 5) {
      WorldBox box{.min = all[0], .max = all[0]};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::min(all[0][axis], all[corner][axis]);
        box.max[axis] = std::max(all[0][axis], all[corner][axis]);
      }
      std::vector<formats::WorldPoint> inside, found;
      for (const formats::WorldPoint& p : all)
        if (p[0] >= box.min[0] && p[0] <= box.max[0] && p[1] >= box.min[1] && p[1] <= box.max[1] &&
            p[2] >= box.min[2] && p[2] <= box.max[2])
          inside.push_back(p);
      const ExportSelection selection = level_selection(dataset, level, box);
      Collector boxed;
      export_points(test::plain_context(), dataset, selection,
                    describe_export(dataset, selection, false), boxed);
      for (const PointBlock& block : boxed.blocks)
        found.insert(found.end(), block.world.begin(), block.world.end());
      EXPECT_GE(inside.size(), 2U);
      EXPECT_EQ(found, inside);
    }
  }
}

TEST_F(ExportTest, RefusesALevelBeyondTheLeaves) {
  build(test::tiny_header());
  const DatasetReader dataset = DatasetReader::open(folder_.path());
  EXPECT_THROW(level_selection(dataset, 3), formats::Error);
}

}  // namespace
}  // namespace cairn::stages
