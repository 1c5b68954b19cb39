// Layers of boxes that are counted by hand: trees of two levels, seen straight from above.
#include "viewer/depth_layers.h"

#include <gtest/gtest.h>

#include <vector>

#include "formats/dataset/node_record.h"

namespace cairn::viewer {
namespace {

using formats::GridBox;
using formats::NodeRecord;

constexpr std::uint32_t kTilesASide = 3;
constexpr std::uint32_t kTiles = kTilesASide * kTilesASide;
constexpr std::int32_t kTile = 10'000;
constexpr PictureSize kSize{640, 640};

/// The grid's box of a tile of a layer; tiles of one layer share no place, and have no thickness.
GridBox tile(std::uint32_t index, std::int32_t height) {
  const auto x = static_cast<std::int32_t>(index % kTilesASide) * kTile;
  const auto y = static_cast<std::int32_t>(index / kTilesASide) * kTile;
  // Short of the next, so that an edge's cell is not counted for both wherever that can be avoided.
  return {{x, y, height}, {x + kTile - kTile / 16, y + kTile - kTile / 16, height}};
}

/// A root with one leaf a tile, `layers` layers one below the other, so far apart as told.
LodTree layered_tree(std::uint32_t layers, std::int32_t apart) {
  const std::uint32_t fanout = layers * kTiles;
  const formats::Tree tree(1000 * fanout, fanout, 1000);
  std::vector<NodeRecord> records(tree.node_count());
  for (std::size_t i = 0; i < records.size(); ++i) {
    NodeRecord& record = records[i];
    record.id = formats::NodeId{i};
    record.point_count = fanout;
    record.block_start.assign(fanout + 1, fanout);
    for (std::uint32_t block = 0; block <= fanout && i == 0; ++block)
      record.block_start[block] = block;
    record.block_start[0] = 0;
    if (i == 0) continue;
    const auto leaf = static_cast<std::uint32_t>(i - 1);
    record.box = tile(leaf % kTiles, -apart * static_cast<std::int32_t>(leaf / kTiles));
    records[0].box.add(record.box);
  }
  return LodTree(tree, {.step = {0.001, 0.001, 0.001}, .offset = {}, .shift = {}}, records);
}

/// From above the middle, so far off that the lowest layer looks hardly smaller than the highest.
View from_above(const LodTree& tree) {
  const glm::dvec3 center = tree.node(0).box.center;
  Camera camera;
  camera.eye = {center.x, center.y, 4000};
  camera.target = {center.x, center.y, 0};
  camera.up = {0, 1, 0};
  camera.fov_y_degrees = 0.6;
  return {camera, kSize, 0.1};
}

double layers_of(const LodTree& tree) {
  const View view = from_above(tree);
  return depth_layers(tree, view, select(tree, view, {}));
}

/// What cells on the edges of tiles, counted for both, add to a layer.
constexpr double kEdges = 0.35;

TEST(DepthLayers, OneFlatLayerIsOne) {
  const double layers = layers_of(layered_tree(1, 0));
  EXPECT_GE(layers, 1);
  EXPECT_LE(layers, 1 + kEdges);
}

TEST(DepthLayers, LayersBehindOneAnotherAddUp) {
  const double one = layers_of(layered_tree(1, 0));
  EXPECT_NEAR(layers_of(layered_tree(2, 1000)), 2 * one, 0.05);
  EXPECT_NEAR(layers_of(layered_tree(5, 1000)), 5 * one, 0.15);
}

TEST(DepthLayers, OnlyWhatIsCoveredCounts) {
  // Two layers over one half of the picture, as seen from aside, are two all the same.
  const LodTree tree = layered_tree(2, 1000);
  Camera camera = from_above(tree).camera();
  camera.eye.x += 15;
  camera.target.x += 15;
  const View view(camera, kSize, 0.1);
  const Selection cut = select(tree, view, {});
  EXPECT_NEAR(depth_layers(tree, view, cut), 2, 2 * kEdges);
}

TEST(DepthLayers, AnEmptyFrontHasNone) {
  const LodTree tree = layered_tree(1, 0);
  Camera camera = from_above(tree).camera();
  camera.target = camera.eye + glm::dvec3(0, 0, 1);  // looks away
  const View view(camera, kSize, 0.1);
  const Selection cut = select(tree, view, {});
  ASSERT_TRUE(cut.front.empty());
  EXPECT_EQ(depth_layers(tree, view, cut), 0);
}

TEST(DepthLayers, ABoxAroundTheEyeCoversAllOfThePicture) {
  const LodTree tree = layered_tree(1, 0);
  Camera camera = from_above(tree).camera();
  const Box& first = tree.node(1).box;
  camera.eye = first.center;
  camera.target = first.center + glm::dvec3(0, 1, 0);
  camera.up = {0, 0, 1};
  const View view(camera, kSize, 0.1);
  Selection cut;
  cut.front = {{.node = 1}};
  EXPECT_EQ(depth_layers(tree, view, cut), 1);
  cut.front = {{.node = 1}, {.node = 1}, {.node = 1}};
  EXPECT_EQ(depth_layers(tree, view, cut), 3);
}

}  // namespace
}  // namespace cairn::viewer
