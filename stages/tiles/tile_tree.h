// The tree of a dataset as tilesets: geometric errors, boxes, and which subtree stands in which file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/tiles/tileset.h"
#include "stages/tiles/tile_content.h"

namespace cairn::stages {

/// What making a tile's content told of it, for nodes by id.
struct TileMeasure {
  double rounding_m = 0;
  double spacing_m = 0;
};

/// The geometric errors of all nodes, metres, by id. All are above 0, and each is less than its parent's.
///
/// Of an inner node it is the recorded *bound*: no input point is farther from the point that stands for it, so what a
/// client draws at a screen-space error of e pixels is nowhere more than e pixels off. (The RMS would promise nothing; and
/// as points lie about 0.4 bounds apart, clients' usual 16 pixels would let gaps of 30 pixels stand.) Where a node's own bound does
/// not exceed its children's errors, which happens where points coincide, it is raised to 17/16 of the largest.
///
/// A leaf has nothing finer, so its error never refines anything; but CesiumJS sizes points by it, and makes one up for 0. It
/// is the distance between the leaf's points, at least its bound, and at most half of the parent's bound where that is more.
std::vector<double> geometric_errors(const formats::DatasetReader& dataset, const TileFrame& frame,
                                     const std::vector<TileMeasure>& measures);

/// "tiles/LEVEL/INDEX" and the suffix: where a node's content, or the tileset that it is the root of, stands.
std::string tile_path(formats::Level level, std::uint64_t index, const char* suffix);

/// Levels that one tileset file spans: as many as keep its tiles, the roots of further files counted, within 2048, but
/// at least one.
formats::Level levels_a_tileset(std::uint32_t fanout);

/// Calls `write` with the path and the tileset of every file, the root's last. `root` is what the root's tileset tells besides
/// its tiles: origin and transform. Returns how many.
std::uint64_t write_tilesets(
    const formats::DatasetReader& dataset, const TileFrame& frame,
    const std::vector<TileMeasure>& measures, const formats::Tileset& root,
    const std::function<void(const std::string& path, const formats::Tileset&)>& write);

}  // namespace cairn::stages
