// Runs a study: every setting on every input, in turn, over and over, so that a machine that becomes slower or faster
// meanwhile does so for all of them alike.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "pipeline/study/study_file.h"
#include "pipeline/study/study_files.h"
#include "stages/context.h"

namespace cairn::pipeline {

struct StudyOptions {
  std::filesystem::path folder;  ///< of the results
  unsigned threads = 1;          ///< of simulating, building and measuring
  bool keep = false;  ///< one dataset of each setting and input stays, in FOLDER/datasets
};

/// One setting on one input.
struct StudyCell {
  std::size_t input = 0;    ///< into StudyFile::inputs
  std::size_t setting = 0;  ///< into StudyFile::settings
  std::vector<StudyRun> runs;
  std::string failure;  ///< why there are fewer runs than repetitions; empty if there are not

  const Measured* measured() const;  ///< null if nothing was measured
};

struct StudyOutcome {
  std::vector<StudyCell> cells;  ///< setting by setting, for each input
  int exit_code = 0;             ///< the greatest of the failures, which were told
};

/// Every second repetition runs backwards, so that of an even drift nothing is left in the mean. Each finished run is
/// kept in FOLDER/runs under a key of settings, scans, program, machine, memory, threads and pictures, and not run
/// again; a build that was under way starts over, since its time is measured. What fails is told and noted in its cell,
/// that of an input in all of its cells, and not tried again in this study; datasets of two repetitions that are not the
/// same bytes are such a failure. Throws Error for a folder that is the user's, and Stopped.
StudyOutcome run_study(const StudyFile& study, const StudyOptions& options,
                       stages::ProgressSink& progress, const std::stop_token& stop);

}  // namespace cairn::pipeline
