#include "stages/tiles/export_tiles.h"

#include <algorithm>
#include <atomic>

#include "formats/error.h"
#include "formats/tiles/tileset.h"
#include "stages/parallel.h"
#include "stages/tiles/tile_content.h"
#include "stages/tiles/tile_tree.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::NodeId;

TileFrame frame_of(const DatasetReader& dataset, const TilesOptions& options) {
  const formats::GridBox& box = dataset.record(NodeId{0}).box;
  TileFrame frame{.metres_per_unit = *std::ranges::max_element(options.unit_m),
                  .unit_m = options.unit_m};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.step_m[axis] = dataset.header().grid.step[axis] * options.unit_m[axis];
    const bool on_the_ground = axis == 2 && !options.geocentric;
    const std::uint32_t span = box.span(static_cast<int>(axis));
    frame.origin[axis] =
        static_cast<std::int32_t>(std::int64_t{box.min[axis]} + (on_the_ground ? 0 : span / 2));
  }
  return frame;
}

/// What the root's tileset tells besides its tiles.
formats::Tileset root_of(const DatasetReader& dataset, const TileFrame& frame,
                         const TilesOptions& options) {
  formats::Tileset root;
  const formats::WorldPoint origin = dataset.header().grid.world(frame.origin);
  root.origin = {.world = origin,
                 .metres_per_unit = options.unit_m[0],
                 .metres_per_height_unit = options.unit_m[2],
                 .crs = options.crs,
                 .colors_for = options.color_client,
                 .points = dataset.header().points};
  if (options.geocentric) {
    root.transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (std::size_t axis = 0; axis < 3; ++axis)
      (*root.transform)[12 + axis] = origin[axis] * options.unit_m[axis];
  } else if (options.place)
    root.transform = formats::east_north_up(*options.place);
  return root;
}

/// Writes the contents of all tiles, any number at a time.
std::vector<TileMeasure> write_contents(const Context& context, const DatasetReader& dataset,
                                        const TileContentMaker& maker,
                                        formats::TileCompression compression, const TileSink& sink,
                                        TilesReport& report) {
  const formats::Tree& tree = dataset.tree();
  std::vector<TileMeasure> measures(tree.node_count());
  std::atomic<std::uint64_t> points = 0, bytes = 0;
  run_in_arena(workers_within(context, maker.working_bytes()), [&] {
    for_each_piece(tree.node_count(), [&](std::uint64_t i) {
      throw_if_stopped(context);
      const NodeId id{i};
      const TileContent content = maker.make(id);
      measures[i] = {.rounding_m = content.rounding_m, .spacing_m = content.spacing_m};
      const std::vector<std::byte> file = formats::write_glb(content.points, compression);
      sink(tile_path(tree.level_of(id), tree.index_on_level(id), ".glb"), file);
      points += content.points.count;
      bytes += file.size();
      if (context.progress != nullptr) context.progress->advance(content.points.count);
    });
  });
  report.points = points;
  report.content_bytes = bytes;
  return measures;
}

std::uint64_t stored_points(const DatasetReader& dataset) {
  std::uint64_t points = 0;
  for (const formats::NodeRecord& record : dataset.nodes()) points += record.point_count;
  return points;
}

}  // namespace

TilesReport export_tiles(const Context& context, const DatasetReader& dataset,
                         const TilesOptions& options, const TileSink& sink) {
  if (dataset.header().refinement != formats::Refinement::kReplace)
    formats::throw_usage("only datasets whose nodes replace their parents become 3D Tiles");
  if (context.progress != nullptr) context.progress->begin("tiles", stored_points(dataset));
  const TileFrame frame = frame_of(dataset, options);
  const TileContentMaker maker(dataset, frame, options.normals, options.color_client);
  TilesReport report{.tiles = dataset.tree().node_count(),
                     .left_out = maker.left_out(),
                     .worker_bytes = maker.working_bytes()};
  const std::vector<TileMeasure> measures =
      write_contents(context, dataset, maker, options.compression, sink, report);
  report.tilesets = write_tilesets(dataset, frame, measures, root_of(dataset, frame, options),
                                   [&](const std::string& path, const formats::Tileset& tileset) {
                                     throw_if_stopped(context);
                                     const std::string text = formats::write_tileset(tileset);
                                     sink(path, std::as_bytes(std::span(text)));
                                     report.tileset_bytes += text.size();
                                   });
  if (context.progress != nullptr) context.progress->end();
  return report;
}

}  // namespace cairn::stages
