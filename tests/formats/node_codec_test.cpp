#include "formats/dataset/node_codec.h"

#include <gtest/gtest.h>

#include <cmath>

#include "formats/bytes.h"
#include "formats/dataset/node_frame.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::formats {
namespace {

struct Encoded {
  NodeRecord record;
  std::vector<std::byte> bytes;
  std::vector<std::span<const std::byte>> sections;
};

Encoded encode(const test::TinyTree& tree, NodeId id, Codec codec = Codec::kLzo) {
  Encoded out;
  out.record.id = id;
  const bool leaf = tree.header.tree().is_leaf(id);
  out.bytes = encode_node(tree.nodes[value_of(id)].points, tree.header, leaf, codec, out.record);
  for (const SectionRef& s : out.record.sections)
    out.sections.push_back(std::span<const std::byte>(out.bytes).subspan(s.offset, s.size_bytes));
  return out;
}

IndexRange block_of(const test::TinyTree& tree, NodeId id) {
  if (value_of(id) == 0) return {};
  const Tree t = tree.header.tree();
  const auto& starts = tree.nodes[value_of(t.parent(id))].block_start;
  const std::size_t child = (value_of(id) - 1) % t.fanout();
  return {starts[child], starts[child + 1] - starts[child]};
}

std::optional<DecodeError> decode(const test::TinyTree& tree, const Encoded& node, NodeData& points,
                                  const SectionSet& wanted = all_sections()) {
  std::size_t failed = 0;
  return decode_node(tree.header, node.record, block_of(tree, node.record.id), node.sections,
                     wanted, points, failed);
}

TEST(NodeCodec, EveryNodeComesBackWithinItsQuantisation) {
  for (const std::int32_t spread : {100, 40'000, 2'000'000'000})
    for (const Codec codec : {Codec::kNone, Codec::kLzo, Codec::kLzo999, Codec::kZstd}) {
      const test::TinyTree tree = test::make_tiny_tree(test::tiny_header(), spread);
      for (const stages::ClusteredNode& node : tree.nodes) {
        const Encoded encoded = encode(tree, node.id, codec);
        NodeData back;
        const auto error = decode(tree, encoded, back);
        ASSERT_FALSE(error) << error->what;
        ASSERT_EQ(back.count(), node.points.count());
        EXPECT_EQ(back.representative, node.points.representative);
        EXPECT_EQ(back.weight, node.points.weight);
        EXPECT_EQ(back.attributes[1], node.points.attributes[1]);
        EXPECT_EQ(back.attributes[3], node.points.attributes[3]);
        const bool leaf = tree.header.tree().is_leaf(node.id);
        const NodeFrame frame = NodeFrame::fit(tree.header, leaf, node.points);
        const double bound = frame.displacement_bound(tree.header.grid);
        EXPECT_EQ(bound == 0, frame.positions_exact());
        for (std::size_t i = 0; i < back.count(); ++i) {
          EXPECT_LE(std::sqrt(squared_distance(tree.header.grid, back.position[i],
                                               node.points.position[i])),
                    bound);
          EXPECT_GE(back.radius[i], node.points.radius[i]);
          EXPECT_LE(back.radius[i], encoded.record.radius_max);
        }
      }
    }
}

TEST(NodeCodec, QuantizeForeseesWhatDecodeGives) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header(), 2'000'000'000);
  for (const stages::ClusteredNode& node : tree.nodes) {
    NodeData foreseen = node.points;
    const bool leaf = tree.header.tree().is_leaf(node.id);
    NodeFrame::fit(tree.header, leaf, node.points)
        .quantize(tree.header.schema, tree.header.grid, foreseen);
    NodeData back;
    ASSERT_FALSE(decode(tree, encode(tree, node.id), back));
    EXPECT_EQ(back.position, foreseen.position);
    EXPECT_EQ(back.radius, foreseen.radius);
    EXPECT_EQ(back.attributes[0], foreseen.attributes[0]);
  }
}

TEST(NodeCodec, LosslessLeavesComeBackBitByBit) {
  DatasetHeader header = test::tiny_header();
  header.lossless_leaves = true;
  header.radius_origin = RadiusOrigin::kInput;
  header.position_bits = 8;
  for (const ScalarType type : {ScalarType::kF32, ScalarType::kF64}) {
    header.schema[0].type = type;
    const test::TinyTree tree = test::make_tiny_tree(header, 2'000'000'000);
    for (const stages::ClusteredNode& node : tree.nodes) {
      if (!header.tree().is_leaf(node.id)) continue;
      NodeData back;
      ASSERT_FALSE(decode(tree, encode(tree, node.id), back));
      EXPECT_EQ(back.position, node.points.position);
      EXPECT_EQ(back.radius, node.points.radius);
      EXPECT_EQ(back.attributes, node.points.attributes);
    }
  }
}

TEST(NodeCodec, GivesOnlyTheSectionsAskedFor) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  const Encoded node = encode(tree, NodeId{1});
  SectionSet wanted;
  wanted.set(kRadiusSection);
  NodeData back;
  ASSERT_FALSE(decode(tree, node, back, wanted));
  EXPECT_TRUE(back.position.empty());
  EXPECT_TRUE(back.representative.empty());
  EXPECT_TRUE(back.attributes[1].empty());
  EXPECT_EQ(back.radius.size(), node.record.point_count);
}

TEST(NodeCodec, InnerNodesMayNameRepresentativesInAnyOrder) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  auto& representative = tree.nodes[1].points.representative;
  std::reverse(representative.begin(), representative.end());
  NodeData back;
  ASSERT_FALSE(decode(tree, encode(tree, NodeId{1}), back));
  EXPECT_EQ(back.representative, representative);
}

TEST(NodeCodec, RefusesEveryTruncatedSection) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  for (const std::uint64_t id : {0, 1, 5}) {
    const Encoded node = encode(tree, NodeId{id});
    for (std::size_t s = 0; s < node.sections.size(); ++s)
      for (std::size_t size = 0; size < node.sections[s].size(); ++size) {
        Encoded cut = node;
        const std::vector<std::byte> part(
            node.sections[s].begin(), node.sections[s].begin() + static_cast<std::ptrdiff_t>(size));
        cut.sections[s] = part;
        NodeData back;
        EXPECT_TRUE(decode(tree, cut, back))
            << "node " << id << " section " << s << " size " << size;
      }
  }
}

TEST(NodeCodec, SurvivesEveryChangedByte) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  for (const std::uint64_t id : {0, 1, 5}) {
    const Encoded node = encode(tree, NodeId{id});
    for (std::size_t s = 0; s < node.sections.size(); ++s)
      for (std::size_t i = 0; i < node.sections[s].size(); ++i)
        for (const int flip : {0x01, 0x80, 0xFF}) {
          Encoded changed = node;
          std::vector<std::byte> bytes(node.sections[s].begin(), node.sections[s].end());
          bytes[i] ^= static_cast<std::byte>(flip);
          changed.sections[s] = bytes;
          NodeData back;
          if (decode(tree, changed, back)) continue;
          EXPECT_EQ(back.count(), node.record.point_count);
          for (const GridPoint& p : back.position)
            EXPECT_TRUE(node.record.position_box.contains(p));
          for (const std::uint32_t r : back.representative)
            EXPECT_LT(r, block_of(tree, NodeId{id}).end());
        }
  }
}

TEST(NodeCodec, RefusesPositionCodesThatAreNone) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  const Encoded node = encode(tree, NodeId{3}, Codec::kNone);
  std::vector<std::byte> plain(2 + 6 * node.record.point_count);  // filter plain, codec none
  NodeData points;
  auto sections = node.sections;
  const auto decode_plain = [&] {
    sections[kPositionSection] = plain;
    std::size_t failed = 99;
    const auto error = decode_node(tree.header, node.record, block_of(tree, node.record.id),
                                   sections, all_sections(), points, failed);
    if (error) EXPECT_EQ(failed, kPositionSection);
    return error ? error->what : "accepted";
  };
  EXPECT_EQ(decode_plain(), "accepted");
  const GridBox& box = node.record.position_box;
  ASSERT_LT(box.span(0), 65535U);
  store_le(plain.data() + 2 + 6, static_cast<std::uint16_t>(box.span(0)));
  EXPECT_EQ(decode_plain(), "accepted");
  EXPECT_EQ(points.position[1][0], box.max[0]);
  store_le(plain.data() + 2 + 6, static_cast<std::uint16_t>(box.span(0) + 1));
  EXPECT_EQ(decode_plain(), "a position code above the largest");
}

TEST(NodeCodec, RefusesRunsThatDoNotAddUp) {
  const test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  Encoded node = encode(tree, NodeId{5});
  node.record.point_count += 1;
  SectionSet wanted;
  wanted.set(kRepresentativeSection);
  NodeData back;
  const auto error = decode(tree, node, back, wanted);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "the representatives stand for a wrong number of points");
}

}  // namespace
}  // namespace cairn::formats
