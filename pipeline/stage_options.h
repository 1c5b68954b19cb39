// What the settings of a build mean to its stages.
#pragma once

#include <cstdint>

#include "formats/dataset/tree.h"
#include "pipeline/build_options.h"
#include "stages/estimate/estimate.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

/// Of the fan-out asked for, or of the one whose leaves come nearest to the target for this many points.
formats::Tree choose_tree(const BuildOptions& options, std::uint64_t points);

/// Whether the stage has anything to do.
bool estimates(const BuildOptions& options);
stages::EstimateOptions estimate_options(const BuildOptions& options);

/// The tree whose leaves are the blocks that effects look at one by one. It does not depend on settings.
formats::Tree effect_blocks(std::uint64_t points);

/// Whether the estimate asks for the number of a point's scan.
bool estimates_by_scan(const BuildOptions& options, const stages::Scans& scans);
stages::ImportOptions import_options(const BuildOptions& options, const stages::Scans& scans);

}  // namespace cairn::pipeline
