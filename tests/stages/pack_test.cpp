#include "stages/pack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

class PackTest : public testing::Test {
 protected:
  std::vector<PackedNode> pack(const test::TinyTree& tree) {
    Packer packer(tree.header, formats::Codec::kLzo, spill_);
    for (const ClusteredNode& node : tree.nodes) packer.take(ClusteredNode(node));
    return packer.finish();
  }

  test::TemporaryFolder folder_;
  formats::OutputFile spill_ = formats::OutputFile::create(folder_ / "spill");
};

TEST_F(PackTest, BytesDoNotDependOnTheOrderOfCalls) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  test::write_tiny_dataset(folder_ / "a", tree);
  test::write_tiny_dataset(folder_ / "b", tree, {6, 2, 0, 5, 1, 3, 4});
  for (const char* name : {"index.bin", "nodes.bin", "metadata.json"})
    EXPECT_EQ(test::read_file(folder_ / "a" / name), test::read_file(folder_ / "b" / name)) << name;
}

TEST_F(PackTest, TakesNodesFromSeveralThreads) {
  formats::DatasetHeader header = test::tiny_header();
  header.points = 2000;
  const test::TinyTree tree = test::make_tiny_tree(header);
  const std::vector<PackedNode> alone = pack(tree);
  Packer packer(tree.header, formats::Codec::kLzo, spill_);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::size_t i = t; i < tree.nodes.size(); i += 4)
          packer.take(ClusteredNode(tree.nodes[i]));
      });
  }
  const std::vector<PackedNode> together = packer.finish();
  ASSERT_EQ(together.size(), alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) EXPECT_EQ(together[i].record, alone[i].record);
}

TEST_F(PackTest, AddsQuantisationToTheBound) {
  formats::DatasetHeader header = test::tiny_header();
  header.position_bits = 4;
  const test::TinyTree tree = test::make_tiny_tree(header);
  const std::vector<PackedNode> nodes = pack(tree);
  for (std::size_t id = 0; id < nodes.size(); ++id) {
    // 4 bits: 15 levels' spacing, of which a point moves at most a half, and a half grid step.
    double squares = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double span = nodes[id].record.position_box.span(static_cast<int>(a));
      if (span > 15) squares += std::pow(0.01 * (span / 30 + 0.5), 2);
    }
    EXPECT_GT(nodes[id].record.bound, tree.nodes[id].bound);
    EXPECT_LE(nodes[id].record.bound, tree.nodes[id].bound + std::sqrt(squares) * 1.001);
  }
}

TEST_F(PackTest, RmsIsTheRootOfTheMeanSquare) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  const std::vector<PackedNode> nodes = pack(tree);
  EXPECT_DOUBLE_EQ(nodes[0].record.rms, std::sqrt(tree.nodes[0].squared_error / 43));
  EXPECT_EQ(nodes[4].record.rms, 0);
  EXPECT_EQ(nodes[4].record.cover_factor, 1.0f);
}

TEST_F(PackTest, ConeHoldsAllNormalsTightly) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  // A root whose normals are z, turned by 60 degrees in turn: the mean is z, the cosine 1/2.
  auto& column = tree.nodes[0].points.attributes[0];
  const float s = std::sqrt(0.75f);
  for (std::size_t i = 0; i < tree.nodes[0].points.count(); ++i) {
    const float n[2][3] = {{s, 0, 0.5f}, {-s, 0, 0.5f}};
    const float z[3] = {0, 0, 1};
    std::memcpy(column.data() + 12 * i, i < 10 ? n[i % 2] : z, 12);
  }
  const formats::NormalCone cone = pack(tree)[0].record.cone;
  EXPECT_NEAR(cone.axis[2], 1, 1e-4);
  EXPECT_NEAR(cone.min_cosine, 0.5, 0.02);  // normals move by up to 0.6 degrees
}

TEST_F(PackTest, NormalsThatCancelGiveTheWholeSphere) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  auto& column = tree.nodes[0].points.attributes[0];
  std::fill(column.begin(), column.end(), std::byte{0});
  EXPECT_EQ(pack(tree)[0].record.cone, formats::NormalCone{});
}

TEST_F(PackTest, SplatsWithoutExtentCoverOnlyThemselves) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  std::ranges::fill(tree.nodes[0].points.radius, 0.0f);
  EXPECT_EQ(pack(tree)[0].record.cover_factor, std::numeric_limits<float>::infinity());
  std::ranges::fill(tree.nodes[0].reach, 0.0);
  EXPECT_EQ(pack(tree)[0].record.cover_factor, 0.0f);
}

TEST_F(PackTest, RefusesToFinishWithANodeMissingOrDoubled) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  Packer packer(tree.header, formats::Codec::kLzo, spill_);
  packer.take(ClusteredNode(tree.nodes[0]));
  EXPECT_THROW(packer.take(ClusteredNode(tree.nodes[0])), formats::Error);
  EXPECT_THROW(packer.finish(), formats::Error);
}

TEST_F(PackTest, GoesOnBehindRestoredNodes) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  const std::vector<PackedNode> whole = pack(tree);
  Packer before(tree.header, formats::Codec::kLzo, spill_);
  for (const ClusteredNode& node : tree.nodes) before.take(ClusteredNode(node));
  const formats::NodeId subtree = formats::Tree(tree.header.tree()).first_child(formats::NodeId{0});
  StateWriter state;
  before.save(subtree, state);
  Packer packer(tree.header, formats::Codec::kLzo, spill_);
  StateReader reader(state.bytes());
  ASSERT_TRUE(packer.restore(subtree, reader));
  const auto restored = tree.header.tree().subtree(subtree);
  for (const ClusteredNode& node : tree.nodes)
    if (std::ranges::find(restored, node.id) == restored.end()) packer.take(ClusteredNode(node));
  const std::vector<PackedNode> again = packer.finish();
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_EQ(again[i].record, whole[i].record);
}

}  // namespace
}  // namespace cairn::stages
