// The effects of a build between import and split: from the imported points to those that are left, and what is told
// of it.
#pragma once

#include "formats/dataset/metadata.h"
#include "pipeline/build_options.h"
#include "stages/context.h"
#include "stages/imported_points.h"

namespace cairn::pipeline {

/// Runs the effects that `options` call for, of which there is at least one. Consumes `imported`; returns the points
/// that are left, on the grid, numbered if `keep_numbers`, with the ledger brought up to date, as are the sources of
/// `extras`. `blocks_are_needed`: no earlier build has left the result.
stages::ImportedPoints run_effects(stages::ImportedPoints&& imported, const BuildOptions& options,
                                   bool keep_numbers, bool blocks_are_needed,
                                   formats::MetadataExtras& extras, stages::Context& context);

}  // namespace cairn::pipeline
