#include "formats/dataset/dataset_reader.h"

#include <gtest/gtest.h>

#include <span>
#include <string_view>
#include <thread>

#include "formats/checksum.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::formats {
namespace {

/// Opens the dataset and reads every section of every node: what a reader that trusts nothing would do.
void read_all(const std::filesystem::path& directory) {
  const DatasetReader reader = DatasetReader::open(directory);
  for (std::uint64_t id = 0; id < reader.tree().node_count(); ++id)
    reader.read_node(NodeId{id}, all_sections());
}

ErrorKind kind_of_refusal(const std::filesystem::path& directory) {
  try {
    read_all(directory);
  } catch (const Error& error) {
    return error.kind();
  }
  return ErrorKind::kUsage;  // which none of these may be
}

class DatasetReaderTest : public testing::Test {
 protected:
  void SetUp() override { test::write_tiny_dataset(folder_.path(), tree_); }

  test::TinyTree tree_ = test::make_tiny_tree(test::tiny_header());
  test::TemporaryFolder folder_;
};

TEST_F(DatasetReaderTest, GivesBackWhatWasPacked) {
  const DatasetReader reader = DatasetReader::open(folder_.path());
  EXPECT_EQ(reader.header(), tree_.header);
  ASSERT_EQ(reader.nodes().size(), tree_.nodes.size());
  for (const stages::ClusteredNode& node : tree_.nodes) {
    const NodeData points = reader.read_node(node.id, all_sections());
    // The helix spans fewer than 65,536 steps: positions are exact.
    EXPECT_EQ(points.position, node.points.position);
    EXPECT_EQ(points.representative, node.points.representative);
    EXPECT_EQ(points.weight, node.points.weight);
    EXPECT_EQ(reader.record(node.id).weight, node.weight);
  }
}

TEST_F(DatasetReaderTest, ReadsFromSeveralThreads) {
  const DatasetReader reader = DatasetReader::open(folder_.path());
  std::vector<std::jthread> threads;
  std::atomic<int> wrong = 0;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int round = 0; round < 20; ++round)
        for (const stages::ClusteredNode& node : tree_.nodes)
          if (reader.read_node(node.id, all_sections()).position != node.points.position) ++wrong;
    });
  threads.clear();
  EXPECT_EQ(wrong, 0);
}

TEST_F(DatasetReaderTest, RefusesEveryFlippedByteOfEveryFile) {
  for (const char* name : {dataset_file::kIndex, dataset_file::kNodes, dataset_file::kMetadata}) {
    const std::vector<std::byte> original = test::read_file(folder_ / name);
    ASSERT_FALSE(original.empty());
    for (std::size_t i = 0; i < original.size(); ++i) {
      std::vector<std::byte> damaged = original;
      damaged[i] ^= static_cast<std::byte>(1 << i % 8);
      test::write_file(folder_ / name, damaged);
      EXPECT_EQ(kind_of_refusal(folder_.path()), ErrorKind::kInput) << name << " byte " << i;
    }
    test::write_file(folder_ / name, original);
  }
}

TEST_F(DatasetReaderTest, RefusesEveryTruncationOfEveryFile) {
  for (const char* name : {dataset_file::kIndex, dataset_file::kNodes, dataset_file::kMetadata}) {
    const std::vector<std::byte> original = test::read_file(folder_ / name);
    for (std::size_t size = 0; size < original.size(); size += size < 300 ? 1 : 7) {
      test::write_file(folder_ / name, std::span(original).first(size));
      EXPECT_EQ(kind_of_refusal(folder_.path()), ErrorKind::kInput) << name << " cut to " << size;
    }
    test::write_file(folder_ / name, original);
  }
}

TEST_F(DatasetReaderTest, NamesFileAndOffsetOfDamage) {
  const DatasetReader reader = DatasetReader::open(folder_.path());
  const SectionRef section = reader.record(NodeId{2}).sections[kRadiusSection];
  std::vector<std::byte> bytes = test::read_file(folder_ / dataset_file::kNodes);
  bytes[section.offset] ^= std::byte{4};
  test::write_file(folder_ / dataset_file::kNodes, bytes);
  try {
    reader.read_node(NodeId{2}, all_sections());
    FAIL() << "damage not noticed";
  } catch (const Error& error) {
    EXPECT_EQ(error.parts().offset, section.offset);
    EXPECT_EQ(error.parts().path.filename(), dataset_file::kNodes);
    EXPECT_NE(error.parts().what.find("section 3 of node 2"), std::string::npos) << error.what();
  }
  // A reader that does not want the section is not bothered.
  SectionSet positions;
  positions.set(kPositionSection);
  EXPECT_NO_THROW(reader.read_node(NodeId{2}, positions));
}

TEST_F(DatasetReaderTest, RefusesMetadataThatIsNotJsonUnderRightChecksums) {
  for (const std::string_view text : {"{\"x\":1e999}", "{", "", "[]"}) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    test::write_file(folder_ / dataset_file::kMetadata, bytes);
    test::edit_index(folder_.path(), [&](DatasetIndex& index) {
      index.head.metadata_size_bytes = bytes.size();
      index.head.metadata_checksum = checksum_of(bytes);
    });
    EXPECT_EQ(kind_of_refusal(folder_.path()), ErrorKind::kInput) << text;
  }
}

TEST_F(DatasetReaderTest, MissingFilesAreSystemErrors) {
  std::filesystem::remove(folder_ / dataset_file::kNodes);
  EXPECT_EQ(kind_of_refusal(folder_.path()), ErrorKind::kSystem);
  EXPECT_EQ(kind_of_refusal(folder_ / "nowhere"), ErrorKind::kSystem);
}

}  // namespace
}  // namespace cairn::formats
