#include "stages/index.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/hilbert.h"
#include "formats/dataset/index_file.h"
#include "formats/error.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

/// Nodes are copied in runs of at least this many bytes.
constexpr std::size_t kWriteBytes = std::size_t{4} << 20;

/// Where the centre of a box lies on the curve through a cube around the root's box.
std::uint64_t curve_key(const formats::GridBox& root, const formats::GridBox& box) {
  std::uint64_t extent = 1;
  for (int a = 0; a < 3; ++a) extent = std::max<std::uint64_t>(extent, root.span(a));
  std::array<std::uint16_t, 3> cell{};
  for (std::size_t a = 0; a < 3; ++a) {
    // Twice the distance of the centre from the root's corner: at most twice the extent.
    const std::int64_t low = std::int64_t{box.min[a]} - root.min[a];
    const std::int64_t high = std::int64_t{box.max[a]} - root.min[a];
    const auto twice = static_cast<std::uint64_t>(std::max<std::int64_t>(0, low + high));
    cell[a] =
        static_cast<std::uint16_t>(std::min<std::uint64_t>(65535, twice * 65535 / (2 * extent)));
  }
  return formats::hilbert_key(cell[0], cell[1], cell[2]);
}

void check_blob(const PackedNode& node, std::span<const std::byte> bytes) {
  for (const formats::SectionRef& section : node.record.sections) {
    if (section.size_bytes == 0) continue;
    CAIRN_CHECK(section.offset <= bytes.size() &&
                section.size_bytes <= bytes.size() - section.offset);
    if (formats::checksum_of(bytes.subspan(section.offset, section.size_bytes)) != section.checksum)
      throw formats::Error(
          formats::ErrorKind::kInvariant,
          {.what = "the spilled bytes of node " +
                   std::to_string(formats::value_of(node.record.id)) + " have changed",
           .offset = node.spill_offset + section.offset});
  }
}

/// Copies the nodes in their final order and makes their section offsets final.
std::uint64_t copy_nodes(const Context& context, const std::vector<std::uint64_t>& order,
                         const formats::OutputFile& spill, std::vector<PackedNode>& nodes,
                         formats::OutputFile& out) {
  std::vector<std::byte> run;
  std::uint64_t written = 0;
  for (const std::uint64_t i : order) {
    throw_if_stopped(context);
    PackedNode& node = nodes[i];
    const std::size_t at = run.size();
    run.resize(at + node.size_bytes);
    spill.read_at(node.spill_offset, std::span(run).subspan(at));
    check_blob(node, std::span(run).subspan(at));
    for (formats::SectionRef& section : node.record.sections)
      if (section.size_bytes != 0) section.offset += written + at;
    if (context.progress != nullptr) context.progress->advance(node.record.point_count);
    if (run.size() < kWriteBytes) continue;
    out.append(run);
    written += run.size();
    run.clear();
  }
  out.append(run);
  return written + run.size();
}

}  // namespace

std::vector<std::uint64_t> storage_order(const formats::Tree& tree,
                                         const std::vector<PackedNode>& nodes) {
  CAIRN_CHECK(nodes.size() == tree.node_count());
  std::vector<std::tuple<formats::Level, std::uint64_t, std::uint64_t>> keys;  // level, curve, id
  keys.reserve(nodes.size());
  for (std::uint64_t id = 0; id < nodes.size(); ++id)
    keys.emplace_back(tree.level_of(formats::NodeId{id}),
                      curve_key(nodes.front().record.box, nodes[id].record.box), id);
  std::ranges::sort(keys);
  std::vector<std::uint64_t> order;
  order.reserve(keys.size());
  for (const auto& key : keys) order.push_back(std::get<2>(key));
  return order;
}

IndexReport write_dataset(const Context& context, const formats::DatasetHeader& header,
                          std::vector<PackedNode> nodes, const formats::OutputFile& spill,
                          formats::MetadataExtras extras, DatasetFiles files) {
  const std::vector<std::uint64_t> order = storage_order(header.tree(), nodes);
  std::uint64_t stored = 0;
  extras.levels.assign(header.tree().leaf_level() + 1, {});
  for (const PackedNode& node : nodes) {
    stored += node.record.point_count;
    extras.levels[header.tree().level_of(node.record.id)].add(node.numerics);
  }
  if (context.progress != nullptr) context.progress->begin("index", stored);
  formats::DatasetIndex index;
  index.head.dataset = header;
  index.head.nodes_size_bytes = copy_nodes(context, order, spill, nodes, files.nodes);
  index.nodes.reserve(nodes.size());
  for (PackedNode& node : nodes) index.nodes.push_back(std::move(node.record));
  const std::string metadata = formats::write_metadata(header, index.nodes, extras);
  index.head.metadata_size_bytes = metadata.size();
  index.head.metadata_checksum = formats::checksum_of(std::as_bytes(std::span(metadata)));
  const std::vector<std::byte> bytes = formats::write_index(index);
  files.metadata.append(std::as_bytes(std::span(metadata)));
  files.index.append(bytes);
  for (formats::OutputFile* file : {&files.nodes, &files.metadata, &files.index}) file->sync();
  if (context.progress != nullptr) context.progress->end();
  return {.nodes = index.nodes.size(),
          .nodes_size_bytes = index.head.nodes_size_bytes,
          .index_size_bytes = bytes.size(),
          .metadata_size_bytes = metadata.size(),
          .bound = index.nodes.front().bound,
          .rms = index.nodes.front().rms};
}

}  // namespace cairn::stages
