// The check of written 3D Tiles, from their files alone: what validators of the formats do not look at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "stages/context.h"

namespace cairn::stages {

/// The bytes of the file at a path of the form a/b/c; nothing if there is none. Called from any thread.
using TileSource = std::function<std::optional<std::vector<std::byte>>(const std::string& path)>;

struct TilesCheck {
  std::uint64_t tiles = 0;
  std::uint64_t tilesets = 0;
  std::uint64_t points = 0;  ///< decoded; each was held against its tile's box
};

/// Follows all references from "tileset.json" on and holds that
///  - each file is there and is read by formats/tiles (the streams of points decoded),
///  - each tile's box lies in its parent's, and all its points in it,
///  - geometric errors are above 0 and fall strictly from parent to child,
///  - tiles hold as many points as they tell, and the leaves together `leaf_points`.
/// Throws Error (kInvariant) naming the file and what does not hold, Stopped, and what the source throws.
/// `worker_bytes` is the memory that a worker needs for one tile.
TilesCheck check_tiles(const Context& context, const TileSource& source, std::uint64_t leaf_points,
                       std::uint64_t worker_bytes);

}  // namespace cairn::stages
