#include "formats/dataset/index_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/record_codec.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::formats {
namespace {

/// An index of one leaf of 3 points with one attribute: small enough to be told byte by byte.
DatasetIndex smallest_index() {
  DatasetIndex index;
  DatasetHeader& header = index.head.dataset;
  header.grid = {.step = {0.5, 0.25, 1}, .offset = {10, 20, -30}, .shift = {1, -2, 3}};
  header.points = 3;
  header.read_points = 5;
  header.dropped_points = 2;
  header.missing_points = 4;
  header.fanout = 2;
  header.target_points = 8;
  header.schema = {{"color", ScalarType::kU8, 3, ReduceRule::kMean}};
  index.head.nodes_size_bytes = 60;
  index.head.metadata_size_bytes = 9;
  index.head.metadata_checksum = 0x1122334455667788;
  NodeRecord record;
  record.id = NodeId{0};
  record.box = {.min = {-1, -2, -3}, .max = {1, 2, 3}};
  record.point_count = 3;
  record.weight = 3;
  record.block_start = {0, 3, 3};
  record.position_box = record.box;
  record.radius_min = 0.25;
  record.radius_max = 0.5;
  record.cone = {.axis = {0, 0, 1}, .min_cosine = 0.5};
  record.digest = {.low = 7, .high = 8};
  record.sections = {{0, 20, 101}, {}, {}, {20, 10, 102}, {30, 30, 103}};
  index.nodes = {record};
  return index;
}

/// Its bytes, as version 1 of the format was laid down: old datasets must stay readable.
constexpr std::string_view kGolden =
    "434149524e0d0a1a01000000d8000000779fbf98552ffef010020000000000003c0000000000000009000000"
    "000000008877665544332211010000000000000030010000d7000000000000000000e03f000000000000d03f"
    "000000000000f03f000000000000244000000000000034400000000000003ec00100000000000000feffffff"
    "ffffffff03000000000000000300000000000000080000000000000005000000000000000200000000000000"
    "04000000000000000200000001000000000000100100000001030105636f6c6f7200000000000000fc72c19f"
    "cf61f1dc0000000000000000ffffffffffffffffffffffffffffffff0000000000000000fffffffffeffffff"
    "fdffffff0100000002000000030000000300000010000000fffffffffefffffffdffffff0100000002000000"
    "0300000003000000000000000000803e0000003f0000803f0000000000000000000000000000000000000000"
    "0000000000000000000000000000803f0000003f000000000700000000000000080000000000000000000000"
    "0300000003000000000000000000000000000000140000000000000065000000000000000000000000000000"
    "0000000000000000000000000000000000000000000000000000000000000000000000000000000014000000"
    "000000000a0000000000000066000000000000001e000000000000001e000000000000006700000000000000";

/// Puts the checksums of a changed index right again, as an attacker would.
void resign(std::vector<std::byte>& bytes, const DatasetHeader& original) {
  const IndexLayout layout = layout_of(original);
  for (std::uint64_t page = 0; page < layout.page_count; ++page) {
    const IndexRange range = layout.bytes_of(page);
    store_le(bytes.data() + layout.head_size_bytes + 8 * page,
             checksum_of(std::span(bytes).subspan(range.first, range.count)));
  }
  store_le(bytes.data() + 16, checksum_of(std::span(bytes).subspan(24, layout.pages_offset - 24)));
}

std::optional<DecodeError> parse(std::span<const std::byte> bytes) {
  DatasetIndex ignored;
  // An exact-size copy on the heap: reading past the end is caught by the sanitizer.
  const std::vector<std::byte> copy(bytes.begin(), bytes.end());
  return parse_index(copy, ignored);
}

/// What parse says of the smallest index after `change`, its checksums being right.
template <typename T>
std::string refusal_after(std::size_t offset, T value) {
  const DatasetIndex index = smallest_index();
  std::vector<std::byte> bytes = write_index(index);
  store_le(bytes.data() + offset, value);
  resign(bytes, index.head.dataset);
  const auto error = parse(bytes);
  return error ? error->what : "accepted";
}

TEST(IndexFile, ComesBackAsItWas) {
  const DatasetIndex index = smallest_index();
  DatasetIndex back;
  const auto error = parse_index(write_index(index), back);
  ASSERT_FALSE(error) << error->what;
  EXPECT_EQ(back, index);
}

TEST(IndexFile, LayoutIsAsTheFormatPageTells) {
  const std::vector<std::byte> bytes = write_index(smallest_index());
  // Head 200 + one attribute of 4 + 5 bytes, padded to 216; one page checksum; one record of
  // 168 + 3 * 4 padded to 16 + 5 * 24 bytes.
  ASSERT_EQ(bytes.size(), 216u + 8 + 168 + 16 + 120);
  const auto u32 = [&](std::size_t at) { return load_le<std::uint32_t>(&bytes[at]); };
  const auto u64 = [&](std::size_t at) { return load_le<std::uint64_t>(&bytes[at]); };
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), 8), "CAIRN\r\n\x1a");
  EXPECT_EQ(u32(8), 1u);
  EXPECT_EQ(u32(12), 216u);
  EXPECT_EQ(u64(24), bytes.size());
  EXPECT_EQ(u64(32), 60u);
  EXPECT_EQ(u64(40), 9u);
  EXPECT_EQ(u64(48), 0x1122334455667788u);
  EXPECT_EQ(u64(56), 1u);
  EXPECT_EQ(u32(64), 304u);
  EXPECT_EQ(u32(68), 65536u / 304);
  EXPECT_EQ(load_le<double>(&bytes[72]), 0.5);
  EXPECT_EQ(load_le<double>(&bytes[96]), 10.0);
  EXPECT_EQ(load_le<std::int64_t>(&bytes[128]), -2);
  EXPECT_EQ(u64(144), 3u);
  EXPECT_EQ(u64(152), 8u);
  EXPECT_EQ(u32(184), 2u);
  EXPECT_EQ(u32(188), 1u);
  EXPECT_EQ(u32(196), 1u);
  EXPECT_EQ(bytes[203], std::byte{5});
  EXPECT_EQ(bytes[204], std::byte{'c'});
  const std::size_t record = 224;
  EXPECT_EQ(u64(record + 8), kNoNode);
  EXPECT_EQ(load_le<std::int32_t>(&bytes[record + 32]), -1);
  EXPECT_EQ(u32(record + 56), 3u);
  EXPECT_EQ(bytes[record + 60], std::byte{16});
  EXPECT_EQ(u64(record + 88), 3u);
  EXPECT_EQ(load_le<float>(&bytes[record + 96]), 0.25f);
  EXPECT_EQ(load_le<float>(&bytes[record + 104]), 1.0f);
  EXPECT_EQ(load_le<float>(&bytes[record + 144]), 0.5f);
  EXPECT_EQ(u64(record + 152), 7u);
  EXPECT_EQ(u32(record + 172), 3u);
  EXPECT_EQ(u64(record + 184 + 3 * 24), 20u);
  EXPECT_EQ(u32(record + 184 + 3 * 24 + 8), 10u);
  EXPECT_EQ(u64(record + 184 + 3 * 24 + 16), 102u);
}

TEST(IndexFile, BytesOfVersionOneStay) {
  std::string hex;
  for (const std::byte b : write_index(smallest_index())) {
    hex += "0123456789abcdef"[std::to_integer<int>(b) >> 4];
    hex += "0123456789abcdef"[std::to_integer<int>(b) & 15];
  }
  EXPECT_EQ(hex, kGolden);
}

TEST(IndexFile, VersionTwoTellsWhatIsEstimated) {
  DatasetIndex index = smallest_index();
  std::vector<std::byte> expected = write_index(index);
  expected[8] = std::byte{2};       // version
  expected[193] = std::byte{2};     // origin of radii
  expected[202] = std::byte{0x81};  // rule: mean, estimated
  resign(expected, index.head.dataset);
  index.head.dataset.radius_origin = RadiusOrigin::kNeighbors;
  index.head.dataset.schema[0].estimated = true;
  EXPECT_EQ(write_index(index), expected);
  DatasetIndex back;
  ASSERT_FALSE(parse_index(expected, back));
  EXPECT_EQ(back, index);
}

TEST(IndexFile, RefusesEveryTruncation) {
  const std::vector<std::byte> bytes = write_index(smallest_index());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_TRUE(parse(std::span(bytes).first(size))) << size << " bytes";
}

TEST(IndexFile, RefusesBytesBehindTheEnd) {
  std::vector<std::byte> bytes = write_index(smallest_index());
  bytes.push_back(std::byte{0});
  EXPECT_TRUE(parse(bytes));
}

TEST(IndexFile, RefusesEveryFlippedBit) {
  const std::vector<std::byte> bytes = write_index(smallest_index());
  for (std::size_t i = 0; i < bytes.size() * 8; ++i) {
    std::vector<std::byte> flipped = bytes;
    flipped[i / 8] ^= static_cast<std::byte>(1 << i % 8);
    EXPECT_TRUE(parse(flipped)) << "bit " << i;
  }
}

TEST(IndexFile, SurvivesEveryByteValueUnderRightChecksums) {
  const DatasetIndex index = smallest_index();
  const std::vector<std::byte> bytes = write_index(index);
  for (std::size_t i = 24; i < bytes.size(); ++i)
    for (const int value : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
      std::vector<std::byte> changed = bytes;
      changed[i] = static_cast<std::byte>(value);
      resign(changed, index.head.dataset);
      DatasetIndex back;
      // Accepted or refused, but never with undefined behaviour; what is accepted can be written again.
      if (!parse_index(changed, back)) EXPECT_EQ(write_index(back), changed) << "byte " << i;
    }
}

TEST(IndexFile, NamesWhatIsImpossible) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr std::size_t kRecord = 224;
  EXPECT_EQ(refusal_after<std::uint32_t>(8, 0), "unknown version of the format");
  EXPECT_EQ(refusal_after<std::uint32_t>(8, 3), "unknown version of the format");
  EXPECT_EQ(refusal_after<std::uint32_t>(8, 2), "wrong version for what the head tells");
  EXPECT_EQ(refusal_after<std::uint8_t>(193, 2), "wrong version for what the head tells");
  EXPECT_EQ(refusal_after<std::uint8_t>(202, 0x81), "wrong version for what the head tells");
  EXPECT_EQ(refusal_after<std::uint8_t>(193, 3), "unknown origin of radii");
  EXPECT_EQ(refusal_after<std::uint8_t>(202, 0x84), "unknown rule of attribute");
  EXPECT_EQ(refusal_after<std::uint64_t>(56, UINT64_MAX), "impossible number of nodes");
  EXPECT_EQ(refusal_after<double>(72, kNaN), "bad grid step");
  EXPECT_EQ(refusal_after<double>(72, 0), "bad grid step");
  EXPECT_EQ(refusal_after<double>(72, 1e308), "the grid reaches beyond finite numbers");
  EXPECT_EQ(refusal_after<std::int64_t>(120, INT64_MAX), "bad grid shift");
  EXPECT_EQ(refusal_after<std::uint64_t>(144, 0), "impossible number of points");
  EXPECT_EQ(refusal_after<std::uint64_t>(144, UINT64_MAX), "impossible number of points");
  EXPECT_EQ(refusal_after<std::uint32_t>(184, 65), "impossible fan-out");
  EXPECT_EQ(refusal_after<std::uint32_t>(188, 2), "wrong number of levels");
  EXPECT_EQ(refusal_after<std::uint8_t>(195, 33), "impossible position bits");
  EXPECT_EQ(refusal_after<std::uint32_t>(196, 2000), "too many attributes");
  EXPECT_EQ(refusal_after<std::uint8_t>(200, 11), "unknown type of attribute");
  EXPECT_EQ(refusal_after<std::uint64_t>(kRecord, 1), "wrong node id of node 0");
  EXPECT_EQ(refusal_after<std::uint32_t>(kRecord + 56, 2),
            "wrong number of points in a leaf of node 0");
  EXPECT_EQ(refusal_after<std::uint64_t>(kRecord + 88, 2), "impossible weight of node 0");
  EXPECT_EQ(refusal_after<float>(kRecord + 96, -1), "bad smallest radius of node 0");
  EXPECT_EQ(refusal_after<double>(kRecord + 120, kNaN), "bad error bound of node 0");
  EXPECT_EQ(refusal_after<std::uint32_t>(kRecord + 172, 2), "bad block start of node 0");
  EXPECT_EQ(refusal_after<std::uint64_t>(kRecord + 184, 50),
            "section reaches beyond the end of the nodes of node 0");
  EXPECT_EQ(refusal_after<std::uint64_t>(kRecord + 184 + 72, 21), "section out of place of node 0");
  EXPECT_EQ(refusal_after<std::uint64_t>(32, 61), "bytes behind the last node");
}

/// What parse says of the tiny dataset's index after `change`, its checksums being right.
std::string refusal_of(const std::function<void(DatasetIndex&)>& change) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  test::edit_index(folder.path(), change);
  const auto error = parse(test::read_file(folder / "index.bin"));
  return error ? error->what : "accepted";
}

TEST(IndexFile, InnerNodesHoldNoMorePointsThanTheTreeGivesThem) {
  // 43 points in 4 leaves: nodes of 11 points. Node 1 is an inner one of 11.
  const auto claim = [](std::uint32_t points) {
    return [points](DatasetIndex& index) {
      NodeRecord& node = index.nodes[1];
      node.point_count = points;
      node.weight = 43;
      node.block_start = {0, 1, points};
    };
  };
  EXPECT_EQ(refusal_of(claim(11)), "accepted");
  EXPECT_EQ(refusal_of(claim(12)), "impossible number of points of node 1");
  EXPECT_EQ(refusal_of(claim(43)), "impossible number of points of node 1");
}

/// A head that claims 2^24 points a node with attributes of 255 doubles: `attributes` of them.
std::string refusal_of_head(std::size_t attributes, std::uint64_t points) {
  DatasetIndex index = smallest_index();
  DatasetHeader& header = index.head.dataset;
  header.schema.clear();
  for (std::size_t i = 0; i < attributes; ++i)
    header.schema.push_back({"a" + std::to_string(i), ScalarType::kF64, 1, ReduceRule::kNone});
  NodeRecord& record = index.nodes[0];
  record.sections.assign(4 + attributes, SectionRef{60, 0, 0});
  record.sections[0] = {0, 60, 1};
  std::vector<std::byte> bytes = write_index(index);
  store_le<std::uint64_t>(bytes.data() + 144, points);
  store_le<std::uint64_t>(bytes.data() + 152, points);
  resign(bytes, header);
  const auto error = parse(bytes);
  return error ? error->what : "accepted";
}

TEST(IndexFile, BoundsTheBytesOfANode) {
  // 28 bytes a point and 8 an attribute: 28 + 8 * 28 = 252 bytes are less than 2^32 / 2^24 = 256.
  EXPECT_NE(refusal_of_head(28, 1 << 24), "too many bytes a node");
  EXPECT_EQ(refusal_of_head(29, 1 << 24), "too many bytes a node");
  EXPECT_EQ(refusal_of_head(1000, 1 << 20), "too many bytes a node");
  EXPECT_EQ(refusal_of_head(28, (1 << 24) + 1), "too many points a node");
}

TEST(IndexFile, NamesAreOfPlainCharacters) {
  // The name "color" begins at byte 204.
  for (const char c : {'C', ' ', '"', '\n', '\0', '\x1b', '\xc3', '/', '-'})
    EXPECT_EQ(refusal_after<char>(204, c), "bad name of attribute") << int{c};
  for (const char c : {'a', 'z', '0', '9', '_'})
    EXPECT_EQ(refusal_after<char>(204, c), "accepted") << c;
  DatasetIndex index = smallest_index();
  index.head.dataset.schema[0].name = "two words";
  EXPECT_THROW(write_index(index), Error);
}

TEST(IndexFile, HeadAndPagesCanBeReadApart) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  const std::vector<std::byte> bytes = test::read_file(folder / "index.bin");
  std::uint64_t prefix = 0;
  ASSERT_FALSE(index_prefix_size(std::span(bytes).first(kIndexFixedBytes), bytes.size(), prefix));
  IndexHead head;
  std::vector<std::uint64_t> checksums;
  ASSERT_FALSE(parse_index_head(std::span(bytes).first(prefix), bytes.size(), head, checksums));
  const IndexLayout layout = layout_of(head.dataset);
  ASSERT_EQ(layout.pages_offset, prefix);
  std::vector<NodeRecord> nodes;
  for (std::uint64_t page = 0; page < layout.page_count; ++page) {
    const IndexRange range = layout.bytes_of(page);
    ASSERT_FALSE(parse_index_page(head, layout, page, checksums[page],
                                  std::span(bytes).subspan(range.first, range.count), nodes));
  }
  DatasetIndex whole;
  ASSERT_FALSE(parse_index(bytes, whole));
  EXPECT_EQ(nodes, whole.nodes);
  EXPECT_EQ(head, whole.head);
}

TEST(IndexFile, RefusesToWriteBeyondTheFormat) {
  DatasetIndex index = smallest_index();
  index.head.dataset.schema[0].name = std::string(256, 'x');
  EXPECT_THROW(write_index(index), Error);
  index = smallest_index();
  index.head.dataset.schema[0].rule = ReduceRule::kNormal;
  EXPECT_THROW(write_index(index), Error);
}

}  // namespace
}  // namespace cairn::formats
