// Simulates a terrestrial laser scanner: an ideal one, which finds for each direction of a station's raster the exact
// first point of the scene, or one with the effects that the scene names.
//
// A ray's way is: direction -> hit (RayCaster) -> echo, what the scanner measured of the hit -> effects, which change
// echoes -> record, a point of a block.
#pragma once

#include <cstdint>

#include "formats/scans/scan_reader.h"
#include "stages/context.h"
#include "stages/simulate/effects/station_effects.h"
#include "stages/simulate/scene.h"

namespace cairn::stages {

enum class ScanFrame : std::uint8_t {
  kSensor,  ///< the station's own; a pose places the scan
  kWorld,
};

/// How a station's scan is told: schema (normal float32 x 3, intensity uint16, color uint8 x 3), encoding, and
/// that at most raster.rays() * most_echoes points come. If a beam may have several echoes, also return_number and
/// return_count, uint8. Coordinates are doubles; with `steps` they are steps of 1e-5 or, where
/// `max_range` asks for more than int32 holds, of a greater power of ten, counted from 0 or, in the world, from
/// the whole number next to the station.
formats::ScanInfo describe_station(const Station& station, ScanFrame frame, bool steps,
                                   std::uint64_t most_echoes = 1);

struct ScanCounts {
  std::uint64_t points = 0;
  EffectCalls effect_calls{};
};

/// Casts all rays of a station and hands the points out in the raster's order, block by block, from one thread at a
/// time. A point has the normal of the surface, facing the scanner, the colour of the object, and as intensity
/// 65,535 times the cosine between the two, but for what the effects do. `description` is what describe_station gave
/// for effects.recorded(station) and effects.most_echoes(). Advances the progress by rays. Memory: the scene's hierarchy and a few blocks a
/// thread. Throws what `sink` throws, and Stopped.
ScanCounts scan_station(const Context& context, const std::vector<SceneObject>& objects,
                        const Station& station, const StationEffects& effects, ScanFrame frame,
                        const formats::ScanInfo& description, const formats::BlockSink& sink);

/// Scales the rasters of all stations, rows and columns alike, so that together they give about `points` points:
/// as many as a coarse scan says, to a few percent. Throws kUsage if no ray of that hits anything or if a raster
/// would have more than kMostCells columns or rows.
void scale_to_points(const Context& context, std::uint64_t points, const Effects& effects,
                     Scene& scene);

}  // namespace cairn::stages
