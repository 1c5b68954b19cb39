// The build: scans in, dataset out. Reads as the list of the stages.
#pragma once

#include <stop_token>

#include "pipeline/build_options.h"
#include "pipeline/build_report.h"
#include "stages/context.h"

namespace cairn::pipeline {

/// Builds the dataset that `options` describe and publishes it in one step. Throws Error; throws
/// stages::Stopped if `stop` is requested. Whatever is thrown, no output and no work folder is left, and
/// what stood at the output's place still stands.
BuildReport build(const BuildOptions& options, stages::ProgressSink& progress,
                  std::stop_token stop);

}  // namespace cairn::pipeline
