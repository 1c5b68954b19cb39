// The results of a study: for each setting on each input what it is measured to be, and what its builds took.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/study/study_runs.h"

namespace cairn::pipeline {

/// Over the repetitions.
struct MetricSummary {
  std::string name;
  double median = 0;  ///< of an even number: the mean of the two in the middle
  double min = 0;
  double max = 0;
  bool repeated = false;  ///< one value a repetition, such as a time; else one for all
};

struct StudyResult {
  std::size_t input = 0;               ///< into StudyResults::inputs
  std::size_t setting = 0;             ///< into StudyResults::settings
  std::string failure;                 ///< empty if all repetitions were built
  std::vector<MetricSummary> metrics;  ///< none if nothing was built
  ErrorCurve errors;
  std::vector<BuildReport> builds;

  const MetricSummary* find(std::string_view name) const;
  /// The median of a metric, or an error of levels at a place: "rms" at `at`, "rms@2" two levels above the leaves,
  /// "rms@10%" where so much of the points is drawn. Nothing if it is not there.
  std::optional<double> value(std::string_view name) const;
};

struct StudyResults {
  struct Input {
    std::string name;
    double points = 0;  ///< kept and removed by effects
  };
  std::string name;
  std::uint64_t repetitions = 0;
  unsigned threads = 0;
  ErrorPlace at;
  std::vector<Input> inputs;
  std::vector<StudySetting> settings;
  std::vector<StudyResult> results;  ///< in the order of inputs, then of settings
};

StudyResults study_results(const StudyFile& study, const StudyOptions& options,
                           const StudyOutcome& outcome);

/// The metrics that results have, by name, in their order; values are those of some result.
std::vector<MetricSummary> all_metrics(const StudyResults& results);
/// The settings that differ, in the order of the table of settings.
std::vector<std::string> varied_keys(const StudyResults& results);
/// The value that a setting has for a key; empty if it has none of its own.
std::string setting_text(const StudySetting& setting, const std::string& key);

/// Whether no other setting on the same input is both at least as good in the two metrics and better in one.
bool on_front(const StudyResults& results, const StudyResult& result, std::string_view cost,
              std::string_view error);

}  // namespace cairn::pipeline
