#include "stages/export.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string>

#include "formats/bytes.h"
#include "formats/constant_size.h"
#include "formats/dataset/metadata.h"
#include "formats/dataset/read_ahead.h"
#include "formats/error.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeData;
using formats::NodeId;

constexpr std::string_view kRadius = formats::attribute_name::kRadius;

/// Whether every point's step fits int32 when it is counted from the grid's own offset.
bool fits_unshifted(const formats::Grid& grid, const formats::GridBox& box) {
  for (std::size_t a = 0; a < 3; ++a)
    if (box.min[a] + grid.shift[a] < INT32_MIN || box.max[a] + grid.shift[a] > INT32_MAX)
      return false;
  return true;
}

/// What is added to grid steps to get the steps of the export: the grid's shift, or nothing where that
/// would not fit and the shift goes into the offset.
std::array<std::int64_t, 3> addend_of(const DatasetReader& dataset) {
  const formats::Grid& grid = dataset.header().grid;
  if (fits_unshifted(grid, dataset.record(NodeId{0}).box)) return grid.shift;
  return {0, 0, 0};
}

std::string weight_name(const formats::Schema& input) {
  std::string name(kWeightAttribute);
  while (formats::find_attribute(input, name)) name += '_';
  return name;
}

bool has_inner_nodes(const DatasetReader& dataset, const ExportSelection& selection) {
  return std::ranges::any_of(selection.nodes, [&](const ExportedNode& node) {
    return !dataset.tree().is_leaf(node.node);
  });
}

formats::Schema schema_of(const formats::DatasetHeader& header, bool leaves_alone) {
  using formats::ReduceRule;
  using formats::ScalarType;
  formats::Schema schema;
  for (const formats::Attribute& attribute : header.schema)
    if (leaves_alone || attribute.rule != ReduceRule::kNone) schema.push_back(attribute);
  if (!leaves_alone || header.radius_origin != formats::RadiusOrigin::kDensity)
    schema.push_back({std::string(kRadius), ScalarType::kF32, 1, ReduceRule::kCoverRadius});
  if (!leaves_alone)
    schema.push_back({weight_name(header.schema), ScalarType::kU64, 1, ReduceRule::kNone});
  return schema;
}

/// Blocks of a node that can be: one a child, of a leaf one.
std::uint32_t blocks_of(const DatasetReader& dataset, NodeId node) {
  return dataset.tree().is_leaf(node) ? 1 : dataset.tree().fanout();
}

/// Calls take(first, end) with the points of each block that is exported.
template <typename Take>
void for_each_block(const DatasetReader& dataset, const ExportedNode& exported, Take take) {
  const formats::NodeRecord& record = dataset.record(exported.node);
  for (std::uint32_t b = 0; b < blocks_of(dataset, exported.node); ++b)
    if ((exported.blocks >> b & 1) != 0) take(record.block_start[b], record.block_start[b + 1]);
}

std::uint64_t points_of(const DatasetReader& dataset, const ExportedNode& exported) {
  std::uint64_t points = 0;
  for_each_block(dataset, exported,
                 [&](std::uint32_t first, std::uint32_t end) { points += end - first; });
  return points;
}

bool may_meet(const formats::Grid& grid, const formats::GridBox& box, const WorldBox& world) {
  const formats::WorldPoint low = grid.world(box.min), high = grid.world(box.max);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (high[axis] < world.min[axis] || low[axis] > world.max[axis]) return false;
  return true;
}

/// Gathers points of a node into blocks of the description's layout.
class BlockFiller {
 public:
  BlockFiller(const DatasetReader& dataset, const formats::ScanInfo& description)
      : header_(dataset.header()), description_(description), addend_(addend_of(dataset)) {}

  void fill(const NodeData& points, std::span<const std::uint32_t> taken) {
    block_.count = taken.size();
    fill_positions(points, taken);
    block_.columns.resize(description_.schema.size());
    for (std::size_t i = 0; i < description_.schema.size(); ++i)
      fill_column(points, description_.schema[i], taken, block_.columns[i]);
  }
  const formats::PointBlock& block() const { return block_; }

 private:
  void fill_positions(const NodeData& points, std::span<const std::uint32_t> taken) {
    const bool steps = description_.encoding == formats::PositionEncoding::kSteps;
    block_.steps.resize(steps ? block_.count : 0);
    block_.world.resize(steps ? 0 : block_.count);
    for (std::size_t i = 0; i < block_.count; ++i) {
      const formats::GridPoint& p = points.position[taken[i]];
      if (steps)
        for (std::size_t a = 0; a < 3; ++a)
          block_.steps[i][a] = static_cast<std::int32_t>(p[a] + addend_[a]);
      else
        block_.world[i] = header_.grid.world(p);
    }
  }

  void fill_column(const NodeData& points, const formats::Attribute& attribute,
                   std::span<const std::uint32_t> taken, std::vector<std::byte>& column) const {
    column.resize(taken.size() * attribute.size_bytes());
    const auto from = column_of(points, attribute.name);
    if (from.empty()) {  // the weight of leaves
      for (std::size_t i = 0; i < taken.size(); ++i)
        formats::store_le(column.data() + i * sizeof(std::uint64_t), std::uint64_t{1});
      return;
    }
    formats::with_constant_size(attribute.size_bytes(), [&](auto size) {
      std::byte* to = column.data();
      for (const std::uint32_t i : taken) {
        std::memcpy(to, from.data() + std::size_t{i} * size, size);
        to += size;
      }
    });
  }
  /// What is neither an attribute of the input nor the radius is the weight.
  std::span<const std::byte> column_of(const NodeData& points, std::string_view name) const {
    if (const auto i = formats::find_attribute(header_.schema, name)) return points.attributes[*i];
    return name == kRadius ? std::as_bytes(std::span(points.radius))
                           : std::as_bytes(std::span(points.weight));
  }

  const formats::DatasetHeader& header_;
  const formats::ScanInfo& description_;
  const std::array<std::int64_t, 3> addend_;
  formats::PointBlock block_;
};

/// Indices of a node's points that are exported.
std::vector<std::uint32_t> taken_points(const DatasetReader& dataset,
                                        const ExportSelection& selection,
                                        const ExportedNode& exported, const NodeData& points) {
  std::vector<std::uint32_t> taken;
  taken.reserve(points.count());
  const formats::Grid& grid = dataset.header().grid;
  for_each_block(dataset, exported, [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t i = first; i < end; ++i)
      if (!selection.box || selection.box->contains(grid.world(points.position[i])))
        taken.push_back(i);
  });
  return taken;
}

std::string title_of(const DatasetReader& dataset, const ExportSelection& selection) {
  if (selection.nodes.empty()) return "Cairn";
  const Level first = dataset.tree().level_of(selection.nodes.front().node);
  const Level last = dataset.tree().level_of(selection.nodes.back().node);
  return first == last ? "Cairn level " + std::to_string(first) : "Cairn cut";
}

}  // namespace

ExportSelection level_selection(const DatasetReader& dataset, Level level,
                                std::optional<WorldBox> box) {
  const formats::Tree& tree = dataset.tree();
  if (level > tree.leaf_level())
    formats::throw_usage("level " + std::to_string(level) +
                         " is beyond the leaves, which are on level " +
                         std::to_string(tree.leaf_level()));
  ExportSelection selection{.nodes = {}, .box = box};
  const std::uint64_t all =
      ~std::uint64_t{0} >> (64 - (level == tree.leaf_level() ? 1 : tree.fanout()));
  for (std::uint64_t i = 0; i < tree.nodes_on(level); ++i) {
    const NodeId node = tree.id(level, i);
    if (!box || may_meet(dataset.header().grid, dataset.record(node).box, *box))
      selection.nodes.push_back({node, all});
  }
  return selection;
}

formats::ScanInfo describe_export(const DatasetReader& dataset, const ExportSelection& selection,
                                  bool steps) {
  const formats::Grid& grid = dataset.header().grid;
  formats::ScanInfo info;
  info.format = title_of(dataset, selection);
  info.schema = schema_of(dataset.header(), !has_inner_nodes(dataset, selection));
  info.encoding = steps ? formats::PositionEncoding::kSteps : formats::PositionEncoding::kFloat64;
  if (steps) {
    info.scale = grid.step;
    info.offset = grid.offset;
    if (!fits_unshifted(grid, dataset.record(NodeId{0}).box))
      for (int axis = 0; axis < 3; ++axis)
        info.offset[static_cast<std::size_t>(axis)] = grid.world(axis, 0);
  }
  for (const ExportedNode& exported : selection.nodes)
    info.claimed_points += points_of(dataset, exported);
  info.present_points = info.claimed_points;
  if (const auto error = formats::read_metadata_crs(dataset.metadata(), info.crs))
    formats::throw_input({.what = error->what,
                          .offset = error->byte_offset,
                          .found = error->found,
                          .expected = error->expected});
  info.crs = formats::records_of_one_crs(dataset.metadata(), info.crs);
  for (formats::AttributeDetails& details : formats::read_metadata_details(dataset.metadata()))
    if (formats::find_attribute(info.schema, details.attribute))
      info.details.push_back(std::move(details));
  return info;
}

std::vector<std::string> left_out_attributes(const DatasetReader& dataset,
                                             const ExportSelection& selection) {
  std::vector<std::string> names;
  if (!has_inner_nodes(dataset, selection)) return names;
  for (const formats::Attribute& attribute : dataset.header().schema)
    if (attribute.rule == formats::ReduceRule::kNone) names.push_back(attribute.name);
  return names;
}

std::uint64_t export_points(const Context& context, const DatasetReader& dataset,
                            const ExportSelection& selection, const formats::ScanInfo& description,
                            formats::ScanWriter& writer) {
  if (context.progress != nullptr) context.progress->begin("export", description.claimed_points);
  BlockFiller filler(dataset, description);
  std::uint64_t written = 0;
  std::vector<NodeId> nodes;
  for (const ExportedNode& exported : selection.nodes) nodes.push_back(exported.node);
  formats::ReadAhead ahead(dataset, formats::all_sections(), nodes);
  for (const ExportedNode& exported : selection.nodes) {
    throw_if_stopped(context);
    ahead.next();
    const NodeData points = dataset.read_node(exported.node, formats::all_sections());
    const std::vector<std::uint32_t> taken = taken_points(dataset, selection, exported, points);
    for (std::size_t first = 0; first < taken.size(); first += formats::kBlockPoints) {
      filler.fill(points, std::span(taken).subspan(
                              first, std::min(formats::kBlockPoints, taken.size() - first)));
      writer.write(filler.block());
    }
    written += taken.size();
    if (context.progress != nullptr) context.progress->advance(points_of(dataset, exported));
  }
  if (context.progress != nullptr) context.progress->end();
  return written;
}

}  // namespace cairn::stages
