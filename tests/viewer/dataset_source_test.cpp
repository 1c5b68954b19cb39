// Columns of points against what the dataset's reader gives, converted here by formula; and that a
// section which is not called for may be as damaged as it likes.
#include "viewer/dataset_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <glm/geometric.hpp>
#include <optional>

#include "formats/error.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::viewer {
namespace {

using formats::DatasetHeader;
using formats::DatasetReader;
using formats::NodeData;
using formats::NodeId;
using formats::ReduceRule;
using formats::ScalarType;

/// Attributes of tiny_header.
constexpr std::size_t kNormal = 0, kColor = 1, kClass = 2, kGpsTime = 3;

class DatasetSourceTest : public testing::Test {
 protected:
  void write(const DatasetHeader& header) { write(test::make_tiny_tree(header)); }
  void write(const test::TinyTree& tree) {
    test::write_tiny_dataset(folder_.path(), tree);
    open();
  }
  void open() {
    dataset_.emplace(DatasetReader::open(folder_.path()));
    tree_.emplace(dataset_->tree(), dataset_->header().grid, dataset_->nodes());
  }
  void SetUp() override { write(test::tiny_header()); }

  NodePoints load(NodeIndex node, const FramePlan& plan) const {
    NodePoints points;
    DatasetSource(*dataset_, *tree_, plan).load(node, points, {});
    return points;
  }
  NodeData data(NodeIndex node) const {
    return dataset_->read_node(NodeId{node}, formats::all_sections());
  }

  /// Flips a bit of a section of every node that has it.
  void damage(std::size_t section) {
    const auto path = folder_ / formats::dataset_file::kNodes;
    auto bytes = test::read_file(path);
    for (const formats::NodeRecord& record : dataset_->nodes()) {
      const formats::SectionRef& at = record.sections.at(section);
      if (at.size_bytes > 0) bytes[at.offset + at.size_bytes / 2] ^= std::byte{1};
    }
    test::write_file(path, bytes);
    open();
  }

  test::TemporaryFolder folder_;
  std::optional<DatasetReader> dataset_;
  std::optional<LodTree> tree_;
};

template <typename T>
T value_at(const std::vector<std::byte>& column, std::size_t index) {
  T value;
  std::memcpy(&value, column.data() + index * sizeof(T), sizeof(T));
  return value;
}

std::uint32_t rgb(unsigned red, unsigned green, unsigned blue) {
  return 0xff000000u + red + 256 * green + 65536 * blue;
}

TEST_F(DatasetSourceTest, PositionsAreTheGridsToFloatAccuracy) {
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const NodeData expected = data(node);
    const NodePoints points = load(node, {});
    const Box& box = tree_->node(node).box;
    const double largest = std::max({box.half.x, box.half.y, box.half.z});
    ASSERT_EQ(points.position.size(), expected.count());
    for (std::size_t i = 0; i < expected.count(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        // Half a float's step at the box's edge, and what doubles lose at national coordinates.
        EXPECT_NEAR(box.center[axis] + static_cast<double>(points.position[i][axis]),
                    dataset_->header().grid.world(axis, expected.position[i][axis]),
                    largest * 0x1p-24 + 4e-9);
  }
}

TEST_F(DatasetSourceTest, ColumnsThatThePlanDoesNotDrawFromAreEmpty) {
  NodePoints points =
      load(1, {.primitive = Primitive::kSplats, .color = ColorSource::kColor, .lighting = true});
  const std::size_t count = data(1).count();
  EXPECT_EQ(points.radius.size(), count);
  EXPECT_EQ(points.color.size(), count);
  EXPECT_EQ(points.normal.size(), count);
  // The same columns are filled again, as a loader does.
  DatasetSource(*dataset_, *tree_, {}).load(2, points, {});
  EXPECT_EQ(points.position.size(), data(2).count());
  EXPECT_TRUE(points.radius.empty());
  EXPECT_TRUE(points.color.empty());
  EXPECT_TRUE(points.normal.empty());
}

TEST_F(DatasetSourceTest, RadiiAreTheNodes) {
  for (NodeIndex node = 0; node < tree_->size(); ++node)
    EXPECT_EQ(load(node, {.primitive = Primitive::kDiscs}).radius, data(node).radius);
}

TEST_F(DatasetSourceTest, NormalsAreOfUnitLengthAndTheNodes) {
  const FramePlan plan{.lighting = true};
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const NodeData expected = data(node);
    const NodePoints points = load(node, plan);
    ASSERT_EQ(points.normal.size(), expected.count());
    for (std::size_t i = 0; i < expected.count(); ++i) {
      const float* n = reinterpret_cast<const float*>(expected.attributes[kNormal].data()) + 3 * i;
      const glm::vec3 unit = glm::normalize(glm::vec3(n[0], n[1], n[2]));
      EXPECT_LE(glm::distance(unpack_normal(points.normal[i]), unit), 2.0f / 511);
    }
  }
}

TEST_F(DatasetSourceTest, ColorsOfEightBitsAreTakenAsTheyAre) {
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const auto column = data(node).attributes[kColor];
    const NodePoints points = load(node, {.color = ColorSource::kColor});
    ASSERT_EQ(3 * points.color.size(), column.size());
    for (std::size_t i = 0; i < points.color.size(); ++i)
      EXPECT_EQ(points.color[i], rgb(value_at<std::uint8_t>(column, 3 * i),
                                     value_at<std::uint8_t>(column, 3 * i + 1),
                                     value_at<std::uint8_t>(column, 3 * i + 2)));
  }
}

TEST_F(DatasetSourceTest, ClassesHaveTheirColors) {
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const auto column = data(node).attributes[kClass];
    const NodePoints points = load(node, {.color = ColorSource::kClassification});
    ASSERT_EQ(points.color.size(), column.size());
    for (std::size_t i = 0; i < points.color.size(); ++i)
      EXPECT_EQ(points.color[i], class_color(value_at<std::uint8_t>(column, i)));
  }
}

TEST_F(DatasetSourceTest, DirectionsOfNormalsAreColors) {
  const NodeData expected = data(3);
  const NodePoints points = load(3, {.color = ColorSource::kNormal});
  EXPECT_TRUE(points.normal.empty());
  ASSERT_EQ(points.color.size(), expected.count());
  for (std::size_t i = 0; i < expected.count(); ++i) {
    const float* n = reinterpret_cast<const float*>(expected.attributes[kNormal].data()) + 3 * i;
    const glm::vec3 unit = glm::normalize(glm::vec3(n[0], n[1], n[2]));
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(points.color[i] >> (8 * axis) & 255, 255 * (1 + unit[axis]) / 2, 0.51f);
  }
}

TEST_F(DatasetSourceTest, HeightsRunThroughTheRampOfTheRoot) {
  // The root's heights, the lowest and the highest hundredth left out.
  const auto height = [&](const formats::GridPoint& p) {
    return dataset_->header().grid.world(2, p[2]);
  };
  std::vector<double> heights;
  for (const auto& p : data(0).position) heights.push_back(height(p));
  std::ranges::sort(heights);
  const double last = static_cast<double>(heights.size() - 1);
  const double least = heights[static_cast<std::size_t>(0.01 * last)];
  const double greatest = heights[static_cast<std::size_t>(0.99 * last)];
  ASSERT_GT(greatest, least);
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const NodeData expected = data(node);
    const NodePoints points = load(node, {.color = ColorSource::kHeight});
    ASSERT_EQ(points.color.size(), expected.count());
    for (std::size_t i = 0; i < expected.count(); ++i) {
      const std::uint32_t ramp =
          ramp_color((height(expected.position[i]) - least) / (greatest - least));
      for (int axis = 0; axis < 3; ++axis)  // the ramp is a table of 1024 steps
        EXPECT_NEAR(points.color[i] >> (8 * axis) & 255, ramp >> (8 * axis) & 255, 1);
    }
  }
}

TEST_F(DatasetSourceTest, WhatOnlyLeavesHaveIsGrayAbove) {
  DatasetHeader header = test::tiny_header();
  header.schema[kColor].rule = ReduceRule::kNone;
  write(header);
  const FramePlan plan{.color = ColorSource::kColor};
  for (const std::uint32_t color : load(0, plan).color) EXPECT_EQ(color, rgb(150, 150, 150));
  const NodeIndex leaf = tree_->size() - 1;
  const auto column = data(leaf).attributes[kColor];
  const NodePoints points = load(leaf, plan);
  ASSERT_EQ(3 * points.color.size(), column.size());
}

/// The color of tiny_header as 16-bit integers; `scale` times what the bytes of the builder hold.
test::TinyTree wide_colors(std::uint16_t scale) {
  DatasetHeader header = test::tiny_header();
  header.schema[kColor].type = ScalarType::kU16;
  test::TinyTree tree = test::make_tiny_tree(header);
  for (stages::ClusteredNode& node : tree.nodes) {
    auto& column = node.points.attributes[kColor];
    for (std::size_t i = 0; i < column.size() / 2; ++i) {
      const auto value =
          static_cast<std::uint16_t>(std::to_integer<unsigned>(column[2 * i]) * scale);
      std::memcpy(column.data() + 2 * i, &value, 2);
    }
  }
  return tree;
}

TEST_F(DatasetSourceTest, WideFieldsThatHoldEightBitsAreAsBrightAsNarrowOnes) {
  for (const unsigned scale : {1u, 256u}) {
    write(wide_colors(static_cast<std::uint16_t>(scale)));
    for (NodeIndex node = 0; node < tree_->size(); ++node) {
      const auto column = data(node).attributes[kColor];
      const NodePoints points = load(node, {.color = ColorSource::kColor});
      ASSERT_EQ(6 * points.color.size(), column.size());
      for (std::size_t i = 0; i < points.color.size(); ++i) {
        const auto part = [&](std::size_t c) {
          return value_at<std::uint16_t>(column, 3 * i + c) / scale;
        };
        EXPECT_EQ(points.color[i], rgb(part(0), part(1), part(2)));
      }
    }
  }
}

TEST_F(DatasetSourceTest, SectionsThatAreNotCalledForAreNotRead) {
  const FramePlan plan{.primitive = Primitive::kPoints, .color = ColorSource::kColor};
  std::vector<NodePoints> before;
  for (NodeIndex node = 0; node < tree_->size(); ++node) before.push_back(load(node, plan));
  for (const std::size_t attribute : {kNormal, kClass, kGpsTime})
    damage(formats::kFirstAttributeSection + attribute);
  damage(formats::kRadiusSection);
  damage(formats::kWeightSection);
  damage(formats::kRepresentativeSection);
  for (NodeIndex node = 0; node < tree_->size(); ++node) {
    const NodePoints points = load(node, plan);
    EXPECT_EQ(points.position, before[node].position);
    EXPECT_EQ(points.color, before[node].color);
  }
}

TEST_F(DatasetSourceTest, ADamagedSectionThatIsCalledForIsRefused) {
  const struct {
    std::size_t section;
    FramePlan plan;
  } cases[] = {
      {formats::kPositionSection, {}},
      {formats::kRadiusSection, {.primitive = Primitive::kDiscs}},
      {formats::kFirstAttributeSection + kNormal, {.lighting = true}},
      {formats::kFirstAttributeSection + kClass, {.color = ColorSource::kClassification}},
  };
  for (const auto& c : cases) {
    write(test::tiny_header());
    damage(c.section);
    try {
      load(0, c.plan);
      ADD_FAILURE() << "section " << c.section << " was taken";
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kInput);
    }
  }
}

}  // namespace
}  // namespace cairn::viewer
