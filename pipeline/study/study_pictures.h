// The pictures of a study: what [pictures] asks for, and what is told of them.
#pragma once

#include <string>
#include <vector>

#include "pipeline/checked_table.h"
#include "pipeline/picture_measure.h"
#include "pipeline/study/metrics.h"

namespace cairn::pipeline {

/// Throws kUsage, naming the line, for a key or value that is not known. Requires a table [pictures].
PictureOptions read_pictures(CheckedTable table);

/// All that decides what is measured, as a text: part of the key of runs.
std::string pictures_key(const PictureOptions& options);

/// "psnr@200k", "frame_ms@200k" and so on, means over the views; of a draw mode that is named "psnr@200k_points".
std::vector<Metric> picture_metrics(const PictureReport& report);

}  // namespace cairn::pipeline
