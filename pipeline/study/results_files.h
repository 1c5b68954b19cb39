// The results of a study as files: all of it as JSON, a row a setting and input as CSV, and what people look at first
// as a table that is Markdown too.
#pragma once

#include <string>

#include "pipeline/study/study_results.h"

namespace cairn::pipeline {

/// One object: "study", "machine", "at", "inputs", "settings", and "results" with the metrics, the errors of all levels
/// and the stages of every build.
std::string results_json(const StudyResults& results);

/// RFC 4180 with a header: input, points, setting, its varied keys, and each metric; of what differs between
/// repetitions the median, and the least and the greatest as NAME_min and NAME_max. What is not known is empty.
std::string results_csv(const StudyResults& results);

/// A table an input: the errors at `at`, bytes, times, and a star where no setting is both faster and more accurate.
std::string results_table(const StudyResults& results);

}  // namespace cairn::pipeline
