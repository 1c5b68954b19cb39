#include "stages/export.h"

#include <algorithm>
#include <cmath>
#include <string>

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

formats::Schema schema_of(const formats::DatasetHeader& header, bool leaf) {
  using formats::ReduceRule;
  using formats::ScalarType;
  formats::Schema schema;
  for (const formats::Attribute& attribute : header.schema)
    if (leaf || attribute.rule != ReduceRule::kNone) schema.push_back(attribute);
  if (!leaf || header.radius_origin != formats::RadiusOrigin::kDensity)
    schema.push_back({std::string(kRadius), ScalarType::kF32, 1, ReduceRule::kCoverRadius});
  if (!leaf) schema.push_back({weight_name(header.schema), ScalarType::kU64, 1, ReduceRule::kNone});
  return schema;
}

/// Copies points [first, first + count) of a node into blocks of the description's layout.
class BlockFiller {
 public:
  BlockFiller(const DatasetReader& dataset, const formats::ScanInfo& description)
      : header_(dataset.header()), description_(description), addend_(addend_of(dataset)) {}

  void fill(const NodeData& points, std::size_t first, std::size_t count) {
    block_.count = count;
    fill_positions(points, first);
    block_.columns.resize(description_.schema.size());
    for (std::size_t i = 0; i < description_.schema.size(); ++i) {
      const std::size_t size = description_.schema[i].size_bytes();
      const auto part =
          column_of(points, description_.schema[i].name).subspan(first * size, count * size);
      block_.columns[i].assign(part.begin(), part.end());
    }
  }
  const formats::PointBlock& block() const { return block_; }

 private:
  void fill_positions(const NodeData& points, std::size_t first) {
    const bool steps = description_.encoding == formats::PositionEncoding::kSteps;
    block_.steps.resize(steps ? block_.count : 0);
    block_.world.resize(steps ? 0 : block_.count);
    for (std::size_t i = 0; i < block_.count; ++i) {
      const formats::GridPoint& p = points.position[first + i];
      if (steps)
        for (std::size_t a = 0; a < 3; ++a)
          block_.steps[i][a] = static_cast<std::int32_t>(p[a] + addend_[a]);
      else
        block_.world[i] = header_.grid.world(p);
    }
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

}  // namespace

formats::ScanInfo describe_export(const DatasetReader& dataset, Level level, bool steps) {
  const Level leaf_level = dataset.tree().leaf_level();
  if (level > leaf_level)
    formats::throw_usage("level " + std::to_string(level) +
                         " is beyond the leaves, which are on level " + std::to_string(leaf_level));
  const formats::Grid& grid = dataset.header().grid;
  formats::ScanInfo info;
  info.format = "Cairn level " + std::to_string(level);
  info.schema = schema_of(dataset.header(), level == leaf_level);
  info.encoding = steps ? formats::PositionEncoding::kSteps : formats::PositionEncoding::kFloat64;
  if (steps) {
    info.scale = grid.step;
    info.offset = grid.offset;
    if (!fits_unshifted(grid, dataset.record(NodeId{0}).box))
      for (int axis = 0; axis < 3; ++axis)
        info.offset[static_cast<std::size_t>(axis)] = grid.world(axis, 0);
  }
  for (std::uint64_t i = 0; i < dataset.tree().nodes_on(level); ++i)
    info.claimed_points += dataset.record(dataset.tree().id(level, i)).point_count;
  info.present_points = info.claimed_points;
  if (const auto error = formats::read_metadata_crs(dataset.metadata(), info.crs))
    formats::throw_input({.what = error->what,
                          .offset = error->byte_offset,
                          .found = error->found,
                          .expected = error->expected});
  return info;
}

std::uint64_t export_level(const Context& context, const DatasetReader& dataset, Level level,
                           const formats::ScanInfo& description, formats::ScanWriter& writer) {
  if (context.progress != nullptr) context.progress->begin("export", description.claimed_points);
  BlockFiller filler(dataset, description);
  std::uint64_t written = 0;
  std::vector<NodeId> nodes;
  for (std::uint64_t i = 0; i < dataset.tree().nodes_on(level); ++i)
    nodes.push_back(dataset.tree().id(level, i));
  formats::ReadAhead ahead(dataset, formats::all_sections(), nodes);
  for (const NodeId id : nodes) {
    throw_if_stopped(context);
    ahead.next();
    const NodeData points = dataset.read_node(id, formats::all_sections());
    for (std::size_t first = 0; first < points.count(); first += formats::kBlockPoints) {
      filler.fill(points, first, std::min(formats::kBlockPoints, points.count() - first));
      writer.write(filler.block());
    }
    written += points.count();
    if (context.progress != nullptr) context.progress->advance(points.count());
  }
  if (context.progress != nullptr) context.progress->end();
  return written;
}

}  // namespace cairn::stages
