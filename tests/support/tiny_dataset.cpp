#include "tests/support/tiny_dataset.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "formats/bytes.h"
#include "formats/dataset/digest.h"
#include "formats/dataset/node_frame.h"
#include "formats/output_file.h"
#include "stages/index.h"
#include "stages/pack.h"

namespace cairn::test {
namespace {

using namespace formats;
using stages::ClusteredNode;

constexpr float kLeafRadius = 0.5f;

/// What the builder knows of a node besides what it hands on.
struct Built {
  ClusteredNode node;
  NodeData decoded;
  GridBox decoded_box;                  ///< with all below
  std::vector<std::uint32_t> point_of;  ///< for each input point of the subtree, the node's point
};

void set_attribute(NodeData& points, const Schema& schema, std::size_t attribute, std::size_t i,
                   double phase) {
  const Attribute& a = schema[attribute];
  std::byte* to = points.attributes[attribute].data() + i * a.size_bytes();
  if (a.rule == ReduceRule::kNormal) {
    const double n[3] = {std::cos(phase), std::sin(phase), 0.2};
    for (int c = 0; c < 3; ++c)
      if (a.type == ScalarType::kF32)
        store_le(to + 4 * c, static_cast<float>(n[c]));
      else
        store_le(to + 8 * c, n[c]);
  } else if (a.type == ScalarType::kF64) {
    store_le(to, phase * 1000);
  } else {
    for (std::size_t c = 0; c < a.size_bytes(); ++c) to[c] = static_cast<std::byte>(i * 7 + c * 31);
  }
}

NodeData input_points(const DatasetHeader& header, IndexRange range, std::int32_t spread) {
  NodeData points;
  points.position.resize(range.count);
  points.radius.assign(range.count, kLeafRadius);
  for (const Attribute& a : header.schema)
    points.attributes.emplace_back(a.size_bytes() * range.count);
  for (std::size_t i = 0; i < range.count; ++i) {
    const std::uint64_t k = range.first + i;
    const double t = static_cast<double>(k) / static_cast<double>(header.points);
    const double phase = 6 * std::numbers::pi * t;
    points.position[i] = {static_cast<std::int32_t>(t * spread),
                          static_cast<std::int32_t>(0.1 * spread * std::cos(phase)),
                          static_cast<std::int32_t>(0.1 * spread * std::sin(phase))};
    points.radius[i] += 0.001f * static_cast<float>(k % 5);
    for (std::size_t a = 0; a < header.schema.size(); ++a)
      set_attribute(points, header.schema, a, i, phase);
  }
  return points;
}

void append_records(const DatasetHeader& header, const NodeData& points, TinyTree& tree) {
  const Schema schema = digest_schema(header);
  const RecordLayout layout(schema, 12);
  tree.record_stride = layout.stride;
  for (std::size_t i = 0; i < points.count(); ++i) {
    ByteWriter to;
    for (const std::int32_t c : points.position[i]) to.write(c);
    for (std::size_t a = 0; a < header.schema.size(); ++a) {
      const std::size_t size = header.schema[a].size_bytes();
      to.write_bytes(std::span(points.attributes[a]).subspan(i * size, size));
    }
    if (header.radius_origin == RadiusOrigin::kInput) to.write(points.radius[i]);
    tree.records.insert(tree.records.end(), to.bytes().begin(), to.bytes().end());
  }
}

Built make_leaf(const DatasetHeader& header, const Tree& t, NodeId id, std::int32_t spread,
                TinyTree& tree) {
  const IndexRange range = t.input_range(t.leaf_level(), t.index_on_level(id));
  Built built;
  built.node.id = id;
  built.node.points = input_points(header, range, spread);
  const std::size_t before = tree.records.size();
  append_records(header, built.node.points, tree);
  built.node.digest = digest_of(std::span(tree.records).subspan(before), tree.record_stride);
  built.node.weight = range.count;
  built.node.block_start.assign(header.fanout + 1, static_cast<std::uint32_t>(range.count));
  built.node.block_start[0] = 0;
  for (std::uint32_t i = 0; i < range.count; ++i) built.point_of.push_back(i);
  return built;
}

/// Quantises the node as pack will, so that the parent can measure what a reader will see.
void decode(const DatasetHeader& header, bool leaf, Built& built) {
  built.decoded = built.node.points;
  NodeFrame::fit(header, leaf, built.decoded).quantize(header.schema, header.grid, built.decoded);
  built.decoded_box = built.node.subtree_box;
  for (const GridPoint& p : built.decoded.position) built.decoded_box.add(p);
}

/// One representative for the points [first, end) of a child: the rounded weighted mean.
void add_representative(const DatasetHeader& header, const Built& child, std::size_t first,
                        std::size_t end, Built& parent) {
  NodeData& points = parent.node.points;
  const NodeData& from = child.node.points;
  std::uint64_t weight = 0;
  std::array<double, 3> sum{0, 0, 0};
  for (std::size_t i = first; i < end; ++i) {
    const std::uint64_t w = from.weight.empty() ? 1 : from.weight[i];
    weight += w;
    for (std::size_t a = 0; a < 3; ++a) sum[a] += static_cast<double>(w) * from.position[i][a];
  }
  GridPoint mean;
  for (std::size_t a = 0; a < 3; ++a)
    mean[a] = static_cast<std::int32_t>(std::lround(sum[a] / static_cast<double>(weight)));
  double reach = 0;
  for (std::size_t i = first; i < end; ++i)
    reach =
        std::max(reach, std::sqrt(squared_distance(header.grid, child.decoded.position[i], mean)) +
                            static_cast<double>(child.decoded.radius[i]));
  points.position.push_back(mean);
  points.weight.push_back(weight);
  points.radius.push_back(static_cast<float>(0.7 * reach));
  parent.node.reach.push_back(reach);
  for (std::size_t a = 0; a < header.schema.size(); ++a) {
    if (header.schema[a].rule == ReduceRule::kNone) continue;
    const std::size_t size = header.schema[a].size_bytes();
    const auto value = std::span(from.attributes[a]).subspan(first * size, size);
    points.attributes[a].insert(points.attributes[a].end(), value.begin(), value.end());
  }
}

void add_child(const DatasetHeader& header, std::uint64_t quota, Built& child, Built& parent) {
  const std::size_t count = child.node.points.count();
  const auto begin = static_cast<std::uint32_t>(parent.node.points.count());
  child.node.points.representative.resize(count);
  for (std::size_t k = 0; k < quota; ++k) {
    const std::size_t first = k * count / quota, end = (k + 1) * count / quota;
    add_representative(header, child, first, end, parent);
    for (std::size_t i = first; i < end; ++i)
      child.node.points.representative[i] = begin + static_cast<std::uint32_t>(k);
  }
  for (const std::uint32_t point : child.point_of)
    parent.point_of.push_back(child.node.points.representative[point]);
  parent.node.weight += child.node.weight;
  parent.node.digest += child.node.digest;
  parent.node.subtree_box.add(child.decoded_box);
  parent.node.block_start.push_back(static_cast<std::uint32_t>(parent.node.points.count()));
}

/// Errors by brute force over the input points, which begin at `first` in input order.
void measure(const DatasetHeader& header, const TinyTree& tree, std::uint64_t first, Built& built) {
  for (std::size_t i = 0; i < built.point_of.size(); ++i) {
    GridPoint input;
    std::memcpy(input.data(), tree.records.data() + (first + i) * tree.record_stride, 12);
    const double d2 =
        squared_distance(header.grid, input, built.node.points.position[built.point_of[i]]);
    built.node.squared_error += d2;
    built.node.bound = std::max(built.node.bound, std::nextafter(std::sqrt(d2), 1e300));
  }
}

}  // namespace

DatasetHeader tiny_header() {
  DatasetHeader header;
  header.grid = {
      .step = {0.01, 0.01, 0.01}, .offset = {500'000, 5'000'000, 100}, .shift = {7, -9, 0}};
  header.points = 43;
  header.read_points = 45;
  header.dropped_points = 2;
  header.fanout = 2;
  header.target_points = 10;
  header.schema = {{"normal", ScalarType::kF32, 3, ReduceRule::kNormal},
                   {"color", ScalarType::kU8, 3, ReduceRule::kMean},
                   {"classification", ScalarType::kU8, 1, ReduceRule::kMajority},
                   {"gps_time", ScalarType::kF64, 1, ReduceRule::kNone}};
  return header;
}

TinyTree make_tiny_tree(DatasetHeader header, std::int32_t spread, std::uint64_t withheld) {
  const Tree t = header.tree();
  TinyTree tree;
  tree.header = header;
  std::vector<Built> built(t.node_count());
  for (std::uint64_t i = 0; i < t.nodes_on(t.leaf_level()); ++i) {
    const NodeId id = t.id(t.leaf_level(), i);
    built[value_of(id)] = make_leaf(header, t, id, spread, tree);
    decode(header, true, built[value_of(id)]);
  }
  for (Level level = t.leaf_level(); level-- > 0;)
    for (std::uint64_t i = 0; i < t.nodes_on(level); ++i) {
      const NodeId id = t.id(level, i);
      Built& parent = built[value_of(id)];
      parent.node.id = id;
      parent.node.block_start = {0};
      parent.node.theta = 15;
      parent.node.grid = 4;
      parent.node.points.attributes.resize(header.schema.size());
      for (std::uint64_t c = 0; c < header.fanout; ++c) {
        const NodeId child{value_of(t.first_child(id)) + c};
        add_child(header, t.quota(child) - (c == 0 ? withheld : 0), built[value_of(child)], parent);
      }
      measure(header, tree, t.input_range(level, i).first, parent);
      decode(header, false, parent);
    }
  for (Built& b : built) tree.nodes.push_back(std::move(b.node));
  return tree;
}

stages::Context plain_context() {
  stages::Context context;
  context.threads = 2;
  context.memory_bytes = std::uint64_t{1} << 30;
  return context;
}

void write_tiny_dataset(const std::filesystem::path& directory, const TinyTree& tree,
                        const std::vector<std::size_t>& order, Codec codec) {
  std::filesystem::create_directories(directory);
  OutputFile spill = OutputFile::create(directory / "spill");
  stages::Packer packer(tree.header, codec, spill);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i)
    packer.take(ClusteredNode(tree.nodes[order.empty() ? i : order[i]]));
  MetadataExtras extras;
  extras.parameters = {{"node_points", "10"}, {"codec", "\"lzo\""}};
  extras.sources = {
      {.name = "helix.ply", .format = "PLY ascii", .claimed = 45, .kept = 43, .non_finite = 2}};
  OutputFile nodes = OutputFile::create(directory / dataset_file::kNodes);
  OutputFile index = OutputFile::create(directory / dataset_file::kIndex);
  OutputFile metadata = OutputFile::create(directory / dataset_file::kMetadata);
  stages::write_dataset(plain_context(), tree.header, packer.finish(), spill, extras,
                        {nodes, index, metadata});
  std::filesystem::remove(directory / "spill");
}

void edit_index(const std::filesystem::path& directory,
                const std::function<void(DatasetIndex&)>& change) {
  const std::filesystem::path path = directory / dataset_file::kIndex;
  DatasetIndex index;
  if (const auto error = parse_index(read_file(path), index)) throw std::runtime_error(error->what);
  change(index);
  write_file(path, write_index(index));
}

std::vector<std::byte> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::vector<std::byte> bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

}  // namespace cairn::test
