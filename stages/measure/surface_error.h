// How far points are from the splats of each level, and how well these cover them.
#pragma once

#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/measure/geometry_error.h"
#include "stages/measure/sample.h"
#include "stages/measure/splat_cache.h"

namespace cairn::stages {

/// Of the points of a sample on the levels 0 to `end` - 1. Tells the progress of each point once. Throws as
/// DatasetReader::read_node, and Stopped.
std::vector<SurfaceError> measure_surfaces(const Context& context,
                                           const formats::DatasetReader& dataset,
                                           const PointSample& points, formats::Level end,
                                           SplatCache& cache);

}  // namespace cairn::stages
