// tileset.json of 3D Tiles 1.1 (OGC 22-025r4): a tree of tiles with boxes, errors and what they hold. A tree too large for
// one file goes on in others: a tile whose content is a tileset stands for that one's root.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/error.h"
#include "formats/tiles/linear_color.h"

namespace cairn::formats {

/// A box along the axes of the tile's frame; metres.
struct TileBox {
  std::array<double, 3> center{0, 0, 0};
  std::array<double, 3> half{0, 0, 0};  ///< half the lengths of its edges, > 0
  friend bool operator==(const TileBox&, const TileBox&) = default;
};

/// What is told of the node behind a tile, as its metadata: properties of the class `node`.
struct TileFacts {
  std::uint32_t level = 0;
  std::uint32_t points = 0;
  double bound = 0;  ///< metres: no input point is farther from the point that stands for it here
  double rms = 0;    ///< metres: root of the mean square of these distances
  double spacing =
      0;  ///< metres: mean diameter of the node's splats, about how far points lie apart
  friend bool operator==(const TileFacts&, const TileFacts&) = default;
};

struct Tile {
  TileBox box;                 ///< holds the points of the tile and of all below it
  double geometric_error = 0;  ///< metres
  std::string content;         ///< a path relative to the tileset's file
  TileFacts facts;
  std::vector<Tile> children;
  friend bool operator==(const Tile&, const Tile&) = default;
};

/// What a root tileset tells of where the points come from.
struct TilesetOrigin {
  /// World coordinates, in the units of the scans, of the origin of the tiles' frame.
  std::array<double, 3> world{0, 0, 0};
  double metres_per_unit = 1, metres_per_height_unit = 1;
  std::string crs;  ///< name of the coordinate reference system; empty if none is known
  ColorClient colors_for = ColorClient::kAny;
  std::uint64_t points = 0;
  friend bool operator==(const TilesetOrigin&, const TilesetOrigin&) = default;
};

struct Tileset {
  double geometric_error = 0;  ///< of drawing nothing
  Tile root;
  /// From the frame of the tiles to the Earth-centred one, by columns.
  std::optional<std::array<double, 16>> transform;
  std::optional<TilesetOrigin> origin;  ///< of a root tileset
  friend bool operator==(const Tileset&, const Tileset&) = default;
};

/// The text of the file; children replace their parent. The same tileset gives the same text.
std::string write_tileset(const Tileset& tileset);

/// Reads what write_tileset writes, never trusting it: numbers are finite, tiles nested at most 64 deep.
[[nodiscard]] std::optional<DecodeError> read_tileset(std::string_view text, Tileset& tileset);

}  // namespace cairn::formats
