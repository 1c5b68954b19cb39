#include "stages/index.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "stages/pack.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

using formats::NodeId;

TEST(StorageOrder, IsCoarseToFineAndLeavesOutNothing) {
  formats::DatasetHeader header = test::tiny_header();
  header.points = 5000;
  const test::TinyTree tree = test::make_tiny_tree(header);
  const formats::Tree t = header.tree();
  std::vector<PackedNode> nodes(tree.nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const formats::GridPoint& p : tree.nodes[i].points.position) nodes[i].record.box.add(p);
    nodes[0].record.box.add(nodes[i].record.box);
  }
  std::vector<std::uint64_t> order = storage_order(t, nodes);
  for (std::size_t i = 1; i < order.size(); ++i)
    EXPECT_LE(t.level_of(NodeId{order[i - 1]}), t.level_of(NodeId{order[i]}));
  std::ranges::sort(order);
  for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

TEST(StorageOrder, EqualBoxesStandById) {
  formats::DatasetHeader header = test::tiny_header();
  std::vector<PackedNode> nodes(header.tree().node_count());
  for (PackedNode& node : nodes) node.record.box.add(formats::GridPoint{INT32_MIN, INT32_MAX, 0});
  nodes[0].record.box.add(formats::GridPoint{INT32_MAX, INT32_MIN, 0});
  EXPECT_EQ(storage_order(header.tree(), nodes), (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6}));
}

class WriteDatasetTest : public testing::Test {
 protected:
  IndexReport write(const std::filesystem::path& nodes_path,
                    const Context& context = test::plain_context()) {
    Packer packer(tree_.header, formats::Codec::kLzo, spill_);
    for (const ClusteredNode& node : tree_.nodes) packer.take(ClusteredNode(node));
    packed_ = packer.finish();
    auto nodes = formats::OutputFile::create(nodes_path);
    auto index = formats::OutputFile::create(folder_ / "index.bin");
    auto metadata = formats::OutputFile::create(folder_ / "metadata.json");
    return write_dataset(context, tree_.header, packed_, spill_, {}, {nodes, index, metadata});
  }

  test::TinyTree tree_ = test::make_tiny_tree(test::tiny_header());
  test::TemporaryFolder folder_;
  formats::OutputFile spill_ = formats::OutputFile::create(folder_ / "spill");
  std::vector<PackedNode> packed_;
};

TEST_F(WriteDatasetTest, ReportsWhatIsOnDisk) {
  const IndexReport report = write(folder_ / "nodes.bin");
  EXPECT_EQ(report.nodes, 7u);
  EXPECT_EQ(report.nodes_size_bytes, std::filesystem::file_size(folder_ / "nodes.bin"));
  EXPECT_EQ(report.index_size_bytes, std::filesystem::file_size(folder_ / "index.bin"));
  EXPECT_EQ(report.metadata_size_bytes, std::filesystem::file_size(folder_ / "metadata.json"));
  EXPECT_EQ(report.rms, formats::DatasetReader::open(folder_.path()).record(NodeId{0}).rms);
}

TEST_F(WriteDatasetTest, AFullDiskIsASystemError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
  try {
    write("/dev/full");
    FAIL() << "written to a full disk";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos) << error.what();
  }
}

TEST_F(WriteDatasetTest, NoticesASpillThatChanged) {
  write(folder_ / "nodes.bin");
  std::vector<std::byte> bytes = test::read_file(folder_ / "spill");
  bytes[bytes.size() / 2] ^= std::byte{16};
  test::write_file(folder_ / "changed", bytes);
  const auto changed = formats::OutputFile::reopen(folder_ / "changed", bytes.size());
  auto nodes = formats::OutputFile::create(folder_ / "nodes.bin");
  auto index = formats::OutputFile::create(folder_ / "index.bin");
  auto metadata = formats::OutputFile::create(folder_ / "metadata.json");
  EXPECT_THROW(write_dataset(test::plain_context(), tree_.header, packed_, changed, {},
                             {nodes, index, metadata}),
               formats::Error);
}

TEST_F(WriteDatasetTest, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  Context context = test::plain_context();
  context.stop = stop.get_token();
  EXPECT_ANY_THROW(write(folder_ / "nodes.bin", context));
}

}  // namespace
}  // namespace cairn::stages
