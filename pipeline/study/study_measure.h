// What a study measures of each dataset.
#pragma once

#include <stop_token>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/study/study_files.h"
#include "stages/context.h"

namespace cairn::pipeline {

/// Throws Error as measuring does, kInvariant for a dataset whose recorded bounds do not hold, and Stopped.
Measured measure_study_dataset(const formats::DatasetReader& dataset, unsigned threads,
                               stages::ProgressSink& progress, const std::stop_token& stop);

}  // namespace cairn::pipeline
