// The build: scans in, dataset out. Reads as the list of the stages.
#pragma once

#include <stop_token>

#include "pipeline/build_options.h"
#include "pipeline/build_report.h"
#include "stages/context.h"

namespace cairn::pipeline {

/// Builds the dataset that `options` describe and publishes it in one step. Throws Error; throws
/// stages::Stopped if `stop` is requested. Whatever is thrown, what stood at the output's place still stands; after a stop,
/// or where disk or memory failed, the work folder stays with what is done, and the same options go on from there.
BuildReport build(const BuildOptions& options, stages::ProgressSink& progress,
                  std::stop_token stop);

}  // namespace cairn::pipeline
