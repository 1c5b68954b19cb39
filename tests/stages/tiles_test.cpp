// The export to 3D Tiles, against the dataset's reader and by brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <mutex>
#include <random>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/tiles/tileset.h"
#include "stages/tiles/check_tiles.h"
#include "stages/tiles/export_tiles.h"
#include "stages/tiles/tile_tree.h"
#include "tests/support/small_build.h"
#include "tests/support/stage_fixture.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::NodeId;

using Files = std::map<std::string, std::vector<std::byte>>;

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class TilesTest : public test::StageFixture {
 protected:
  /// Points of a wavy surface, so far from the origin of a fine grid that no node's span fits 16 bits on x and y.
  void build(std::uint32_t fanout, std::uint64_t node_points, int count = 20'000) {
    std::mt19937 random(11);
    test::SmallBuild made{.scale = {0.001, 0.001, 0.001},
                          .offset = {4e6, 5e5, 0},
                          .fanout = fanout,
                          .node_points = node_points};
    for (int i = 0; i < count; ++i) {
      const auto x = static_cast<std::int32_t>(random() % 4'000'000);
      const auto y = static_cast<std::int32_t>(random() % 3'000'000);
      made.points.push_back(
          {x - 1'000'000, y, static_cast<std::int32_t>(3000 * std::sin(x * 1e-6))});
    }
    test::write_built(made, folder() / "built.cairn", context());
    dataset_.emplace(DatasetReader::open(folder() / "built.cairn"));
  }
  void build_tiny() {
    test::write_tiny_dataset(folder() / "tiny.cairn", test::make_tiny_tree(test::tiny_header()));
    dataset_.emplace(DatasetReader::open(folder() / "tiny.cairn"));
  }

  Files export_all(const TilesOptions& options = {}, unsigned threads = 2) {
    Files files;
    std::mutex mutex;
    Context with = context();
    with.threads = threads;
    report_ = export_tiles(
        with, *dataset_, options, [&](const std::string& path, std::span<const std::byte> bytes) {
          const std::lock_guard lock(mutex);
          EXPECT_TRUE(files.try_emplace(path, bytes.begin(), bytes.end()).second) << path;
        });
    return files;
  }
  TilesCheck check(const Files& files) {
    return check_tiles(
        context(),
        [&](const std::string& path) -> std::optional<std::vector<std::byte>> {
          const auto at = files.find(path);
          return at == files.end() ? std::nullopt : std::optional(at->second);
        },
        dataset_->header().points, 1 << 20);
  }
  /// Whether the check fails as an invariant that is broken, and with these words.
  void expect_fault(const Files& files, const std::string& words) {
    try {
      check(files);
      ADD_FAILURE() << "no fault is found: " << words;
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kInvariant);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  static formats::TilePoints points_of(const Files& files, const std::string& path) {
    formats::TilePoints points;
    const auto error = formats::read_glb(files.at(path), points);
    EXPECT_FALSE(error) << error->what;
    return points;
  }
  static formats::Tileset tileset_of(const Files& files, const std::string& path = "tileset.json") {
    formats::Tileset tileset;
    const auto error = formats::read_tileset(text_of(files.at(path)), tileset);
    EXPECT_FALSE(error) << error->what;
    return tileset;
  }

  std::optional<DatasetReader> dataset_;
  TilesReport report_;
};

TEST_F(TilesTest, PointsAreWhereTheReaderHasThem) {
  build(4, 300);
  const Files files = export_all();
  const formats::Tree& tree = dataset_->tree();
  const formats::Grid& grid = dataset_->header().grid;
  const auto origin = tileset_of(files).origin.value().world;
  for (std::uint64_t i = 0; i < tree.node_count(); ++i) {
    const NodeId id{i};
    const formats::NodeData node = dataset_->read_node(id, formats::all_sections());
    const formats::TilePoints points =
        points_of(files, tile_path(tree.level_of(id), tree.index_on_level(id), ".glb"));
    ASSERT_EQ(points.count, node.count());
    for (std::size_t k = 0; k < node.count(); ++k)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double wanted = grid.world(node.position[k])[axis] - origin[axis];
        const auto code =
            formats::load_le<std::uint16_t>(&points.columns[0].values[8 * k + 2 * axis]);
        // Half of one of 65,535 steps through the node's box, and what doubles round at 4e6.
        const double span = grid.step[axis] * dataset_->record(id).box.span(static_cast<int>(axis));
        ASSERT_NEAR(points.origin[axis] + points.scale[axis] * code, wanted,
                    std::max(span / 65535 / 2, 0.0) + 2e-9);
      }
  }
}

TEST_F(TilesTest, TheCheckHoldsAndCounts) {
  build(3, 200);
  const Files files = export_all();
  const TilesCheck checked = check(files);
  std::uint64_t stored = 0;
  for (const formats::NodeRecord& record : dataset_->nodes()) stored += record.point_count;
  EXPECT_EQ(checked.points, stored);
  EXPECT_EQ(checked.tiles, dataset_->tree().node_count());
  EXPECT_EQ(checked.tilesets, report_.tilesets);
  EXPECT_EQ(files.size(), report_.tiles + report_.tilesets);
}

TEST_F(TilesTest, LargeTreesGoOnInOtherFiles) {
  build(2, 4, 9000);  // 2^11 leaves
  const Files files = export_all();
  EXPECT_GT(report_.tilesets, 1U);
  EXPECT_EQ(check(files).tilesets, report_.tilesets);
  for (const auto& [path, bytes] : files)
    if (path.ends_with(".json")) {
      std::size_t tiles = 0;
      for (std::size_t at = 0;
           (at = text_of(bytes).find("\"boundingVolume\"", at)) != std::string::npos; ++at)
        ++tiles;
      EXPECT_LE(tiles, 2048U);
      EXPECT_FALSE(tileset_of(files, path).root.children.empty()) << path;
    }
}

TEST_F(TilesTest, LeavesNeedNoFileOfTheirOwn) {
  build(2, 4, 4096);  // 2^10 leaves: a file holds 2^11 - 1 tiles
  ASSERT_EQ(dataset_->tree().leaf_level(), 10U);
  check(export_all());
  EXPECT_EQ(report_.tilesets, 1U);
}

TEST_F(TilesTest, LevelsAFileFollowTheSumOfTiles) {
  for (std::uint32_t fanout = 2; fanout <= 64; ++fanout) {
    const formats::Level levels = levels_a_tileset(fanout);
    const auto tiles = [&](formats::Level below) {
      double sum = 0;
      for (formats::Level k = 0; k <= below; ++k) sum += std::pow(fanout, k);
      return sum;
    };
    EXPECT_GE(levels, 1U);
    EXPECT_TRUE(tiles(levels) <= 2048 || levels == 1) << fanout;
    EXPECT_GT(tiles(levels + 1), 2048) << fanout;
  }
}

TEST_F(TilesTest, ErrorsAreBoundsAndFall) {
  build(4, 300);
  export_all();
  TileFrame frame;
  frame.step_m = dataset_->header().grid.step;
  const std::vector<TileMeasure> measures(dataset_->tree().node_count(),
                                          {.rounding_m = 0, .spacing_m = 0.5});
  const std::vector<double> errors = geometric_errors(*dataset_, frame, measures);
  for (std::uint64_t i = 0; i < errors.size(); ++i) {
    EXPECT_GT(errors[i], 0);
    EXPECT_GE(errors[i], dataset_->record(NodeId{i}).bound);
    if (i > 0) {
      EXPECT_LT(errors[i], errors[value_of(dataset_->tree().parent(NodeId{i}))]);
    }
  }
  EXPECT_EQ(errors[0], dataset_->record(NodeId{0}).bound);
}

TEST_F(TilesTest, ColoursAndAttributesAreThoseOfTheNodes) {
  build_tiny();
  const Files files = export_all();
  const formats::Schema& schema = dataset_->header().schema;
  const auto color = formats::find_attribute(schema, "color").value();
  const auto classification = formats::find_attribute(schema, "classification").value();
  const NodeId leaf = dataset_->tree().id(2, 1);
  const formats::NodeData node = dataset_->read_node(leaf, formats::all_sections());
  const formats::TilePoints points = points_of(files, "tiles/2/1.glb");
  std::map<std::string, formats::TileColumn> columns;
  for (const auto& column : points.columns) columns[column.semantic] = column;
  EXPECT_FALSE(columns.contains("NORMAL"));
  ASSERT_TRUE(columns.contains("COLOR_0") && columns.contains("_CLASSIFICATION"));
  EXPECT_FALSE(columns.contains("_GPS_TIME"));
  EXPECT_EQ(std::count(report_.left_out.begin(), report_.left_out.end(), "gps_time"), 1);
  const bool wide = schema[color].type == formats::ScalarType::kU16;
  for (std::size_t i = 0; i < node.count(); ++i) {
    EXPECT_EQ(columns["_CLASSIFICATION"].values[4 * i], node.attributes[classification][i]);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto linear =
          formats::load_le<std::uint16_t>(&columns["COLOR_0"].values[8 * i + 2 * c]) / 65535.0;
      const double shown =
          linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
      const double wanted =
          wide ? formats::load_le<std::uint16_t>(&node.attributes[color][6 * i + 2 * c]) / 65535.0
               : std::to_integer<int>(node.attributes[color][3 * i + c]) / 255.0;
      EXPECT_NEAR(shown, wanted, 3. / 255);
    }
  }
}

/// A surface that is measured in feet across and in metres up is steeper than its numbers tell, and so are its normals: they
/// stay at right angles to what lies in it.
TEST_F(TilesTest, NormalsComeBackThroughTheNodesMatrix) {
  build_tiny();
  for (const double height_m : {1.0, 0.3048}) {
    SCOPED_TRACE(height_m);
    const Files files = export_all({.normals = true, .unit_m = {1, 1, height_m}});
    const auto normal = formats::find_attribute(dataset_->header().schema, "normal").value();
    const formats::NodeData node = dataset_->read_node(NodeId{0}, formats::all_sections());
    const formats::TilePoints points = points_of(files, "tiles/0/0.glb");
    const formats::TileColumn& column = points.columns.at(1);
    ASSERT_EQ(column.semantic, "NORMAL");
    for (std::size_t i = 0; i < node.count(); ++i) {
      std::array<double, 3> turned{};
      double length = 0, wanted_length = 0, dot = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        turned[a] = formats::load_le<std::int16_t>(&column.values[8 * i + 2 * a]) / points.scale[a];
        const double wanted = formats::load_le<float>(&node.attributes[normal][12 * i + 4 * a]) /
                              (a == 2 ? height_m : 1);
        length += turned[a] * turned[a];
        wanted_length += wanted * wanted;
        dot += turned[a] * wanted;
      }
      EXPECT_GT(dot / std::sqrt(length * wanted_length), 0.99999);
    }
  }
}

TEST_F(TilesTest, ThreadsChangeNoByte) {
  build(4, 300);
  const Files one = export_all({}, 1);
  EXPECT_TRUE(one == export_all({}, 2));
  EXPECT_TRUE(one == export_all({}, 7));
}

TEST_F(TilesTest, OnePointAndEqualPoints) {
  test::SmallBuild made{.points = {{5, 6, 7}}, .node_points = 100};
  test::write_built(made, folder() / "one.cairn", context());
  dataset_.emplace(DatasetReader::open(folder() / "one.cairn"));
  EXPECT_EQ(check(export_all()).points, 1U);
  made.points.assign(3000, {5, 6, 7});
  test::write_built(made, folder() / "equal.cairn", context());
  dataset_.emplace(DatasetReader::open(folder() / "equal.cairn"));
  EXPECT_GE(check(export_all()).points, 3000U);
}

TEST_F(TilesTest, LargeCoordinatesStandInTheTransformAlone) {
  build(4, 300);
  for (const auto& [path, bytes] : export_all({.place = formats::GeographicPlace{8, 47, 400}}))
    if (path.ends_with(".glb")) {
      formats::TilePoints points;
      ASSERT_FALSE(formats::read_glb(bytes, points));
      for (const double x : points.origin) EXPECT_LT(std::abs(x), 4000);
    }
  EXPECT_EQ(tileset_of(export_all({.place = formats::GeographicPlace{8, 47, 400}})).transform,
            formats::east_north_up({8, 47, 400}));
  const formats::Tileset geocentric = tileset_of(export_all({.geocentric = true}));
  const auto origin = geocentric.origin.value().world;
  for (std::size_t a = 0; a < 3; ++a) EXPECT_EQ(geocentric.transform.value()[12 + a], origin[a]);
  EXPECT_FALSE(tileset_of(export_all()).transform);
}

TEST_F(TilesTest, TheCheckFindsDamage) {
  build(4, 300);
  const Files good = export_all();
  const auto changed = [&](const std::string& path, const std::string& from,
                           const std::string& to) {
    Files files = good;
    std::string text = text_of(files.at(path));
    text.replace(text.find(from), from.size(), to);
    const auto bytes = std::as_bytes(std::span(text));
    files[path].assign(bytes.begin(), bytes.end());
    return files;
  };
  const auto edited = [&](const std::function<void(formats::Tileset&)>& edit) {
    Files files = good;
    formats::Tileset tileset = tileset_of(good);
    edit(tileset);
    const std::string text = formats::write_tileset(tileset);
    const auto bytes = std::as_bytes(std::span(text));
    files["tileset.json"].assign(bytes.begin(), bytes.end());
    return files;
  };
  Files files = good;
  files.erase("tiles/1/2.glb");
  expect_fault(files, "is not there");
  files = good;
  files["tiles/1/2.glb"].resize(200);
  expect_fault(files, "tiles/1/2.glb");
  files = good;
  std::swap(files["tiles/1/2.glb"], files["tiles/1/1.glb"]);
  expect_fault(files, "outside its tile's box");
  expect_fault(changed("tileset.json", "\"tiles/1/3.glb\"", "\"../1/3.glb\""),
               "outside the folder");
  expect_fault(changed("tileset.json", "\"tiles/1/3.glb\"", "\"tiles/1/2.glb\""), "same content");
  expect_fault(edited([](auto& t) { t.root.children[1].geometric_error = t.root.geometric_error; }),
               "not below its parent's");
  expect_fault(edited([](auto& t) { t.root.children[1].box.half[0] *= 3; }),
               "not inside its parent's");
  expect_fault(edited([](auto& t) { t.root.children[1].facts.points -= 1; }),
               "wrong number of points");
  expect_fault(edited([](auto& t) { t.root.children.pop_back(); }), "leaves hold a wrong number");
  expect_fault(edited([](auto& t) { t.root.box.half[2] *= 0.9; }), "not inside its parent's");
}

}  // namespace
}  // namespace cairn::stages
