// Export as 3D Tiles 1.1: every node becomes a tile, whose points are a binary glTF file; children replace their
// parents. The files are told in formats/tiles/.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/tiles/earth.h"
#include "formats/tiles/glb.h"
#include "formats/tiles/linear_color.h"
#include "stages/context.h"

namespace cairn::stages {

struct TilesOptions {
  formats::TileCompression compression = formats::TileCompression::kMeshopt;
  formats::ColorClient color_client = formats::ColorClient::kAny;
  bool normals = false;  ///< write them, if there are any: clients then shade the points
  std::array<double, 3> unit_m{1, 1, 1};  ///< metres in a unit of each axis; > 0
  bool geocentric = false;  ///< coordinates are Earth-centred: tiles stand where they say
  std::optional<formats::GeographicPlace>
      place;        ///< where the others stand; nothing: in a frame of their own
  std::string crs;  ///< a name, to be told
};

struct TilesReport {
  std::uint64_t tiles = 0;
  std::uint64_t tilesets = 0;
  std::uint64_t points = 0;         ///< of all tiles
  std::uint64_t content_bytes = 0;  ///< of all binary glTF files
  std::uint64_t tileset_bytes = 0;
  std::vector<std::string> left_out;  ///< attributes that tiles do not have
  std::uint64_t worker_bytes = 0;     ///< memory that a worker needs for one tile
};

/// Stores a file under a path of the form a/b/c. Called from any thread, once a path.
using TileSink = std::function<void(const std::string& path, std::span<const std::byte> bytes)>;

/// Writes "tileset.json", "tiles/LEVEL/INDEX.glb" and, in large trees, "tiles/LEVEL/INDEX.json". The origin of the tiles'
/// frame is the middle of the dataset's box, on the ground of it (its least z) unless coordinates are geocentric; large coordinates are
/// in the root's transform alone. Bytes do not depend on threads. Memory: per worker what a node and its tile take; workers
/// are as many as fit. Throws what the reader and the sink throw, Stopped, and Error (kUsage) for a dataset whose
/// children add to their parents.
TilesReport export_tiles(const Context& context, const formats::DatasetReader& dataset,
                         const TilesOptions& options, const TileSink& sink);

}  // namespace cairn::stages
