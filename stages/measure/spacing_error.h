// How evenly the stored points of a level lie, and how far they are from the true surface if that is known.
#pragma once

#include <functional>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/measure/geometry_error.h"
#include "stages/measure/splat_cache.h"

namespace cairn::stages {

/// Of about `wanted` stored points of a level: `spacing` and, if `true_distance` is given, `truth`. Tells the
/// progress of each point. Throws as DatasetReader::read_node, and Stopped.
GeometryError measure_stored(
    const Context& context, const formats::DatasetReader& dataset, formats::Level level,
    std::uint64_t wanted, SplatCache& cache,
    const std::function<double(const formats::WorldPoint&)>& true_distance);

}  // namespace cairn::stages
