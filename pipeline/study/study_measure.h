// What a study measures of each dataset.
#pragma once

#include <optional>
#include <stop_token>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/picture_measure.h"
#include "pipeline/study/study_files.h"
#include "stages/context.h"

namespace cairn::pipeline {

/// Pictures are measured if they are given. Throws Error as measuring does, kInvariant for a dataset whose recorded
/// bounds do not hold, and Stopped.
Measured measure_study_dataset(const formats::DatasetReader& dataset,
                               const std::optional<PictureOptions>& pictures, unsigned threads,
                               stages::ProgressSink& progress, const std::stop_token& stop);

}  // namespace cairn::pipeline
