#include "pipeline/study/study_results.h"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::pipeline {
namespace {

double seconds_of(const StudyRun& run) { return run.build.elapsed_s; }

struct RunMetric {
  const char* name;
  double (*of)(const StudyRun& run);
};

// To add what is told of every build: a row here.
constexpr RunMetric kRunMetrics[] = {
    {"build_s", seconds_of},
    {"build_cpu_s",
     [](const StudyRun& run) {
       double seconds = 0;
       for (const StageTiming& stage : run.build.stages) seconds += stage.cpu_seconds;
       return seconds;
     }},
    {"build_s_per_M",
     [](const StudyRun& run) { return 1e6 * seconds_of(run) / static_cast<double>(run.points); }},
    {"peak_memory_bytes",
     [](const StudyRun& run) { return static_cast<double>(run.build.peak_memory_bytes); }},
};

template <typename Of>
MetricSummary summary_of(std::string name, const std::vector<StudyRun>& runs, Of of) {
  std::vector<double> values;
  for (const StudyRun& run : runs) values.push_back(of(run));
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  const double median =
      values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
  return {std::move(name), median, values.front(), values.back(), /*repeated=*/true};
}

MetricSummary measured_once(std::string name, double value) {
  return {std::move(name), value, value, value};
}

/// Wall and processor seconds of a stage; 0 in a run without it.
double stage_seconds(const StudyRun& run, const std::string& stage, double StageTiming::*seconds) {
  double sum = 0;
  for (const StageTiming& timing : run.build.stages)
    if (timing.name == stage) sum += timing.*seconds;
  return sum;
}

std::vector<MetricSummary> summaries_of(const StudyCell& cell, const ErrorPlace& at) {
  std::vector<MetricSummary> all;
  if (const Measured* measured = cell.measured()) {
    for (const std::string_view error : level_metrics())
      if (const auto value = error_at(measured->errors, error, at))
        all.push_back(measured_once(std::string(error), *value));
    if (const auto points = points_at(measured->errors, at))
      all.push_back(measured_once("points_drawn", *points));
    for (const Metric& metric : measured->metrics)
      all.push_back(measured_once(metric.name, metric.value));
  }
  if (cell.runs.empty()) return all;
  for (const RunMetric& metric : kRunMetrics)
    all.push_back(summary_of(metric.name, cell.runs, metric.of));
  for (const StageTiming& stage : cell.runs.front().build.stages) {
    const auto of = [&](double StageTiming::*seconds) {
      return [&stage, seconds](const StudyRun& run) {
        return stage_seconds(run, stage.name, seconds);
      };
    };
    all.push_back(summary_of(stage.name + "_s", cell.runs, of(&StageTiming::seconds)));
    all.push_back(summary_of(stage.name + "_cpu_s", cell.runs, of(&StageTiming::cpu_seconds)));
  }
  return all;
}

}  // namespace

const MetricSummary* StudyResult::find(std::string_view name) const {
  const auto at = std::find_if(metrics.begin(), metrics.end(),
                               [&](const MetricSummary& metric) { return metric.name == name; });
  return at == metrics.end() ? nullptr : &*at;
}

std::optional<double> StudyResult::value(std::string_view name) const {
  if (const MetricSummary* metric = find(name)) return metric->median;
  const std::size_t sign = name.find('@');
  if (sign == std::string_view::npos) return std::nullopt;
  const auto place = parse_place(name.substr(sign + 1));
  return place ? error_at(errors, name.substr(0, sign), *place) : std::nullopt;
}

StudyResults study_results(const StudyFile& study, const StudyOptions& options,
                           const StudyOutcome& outcome) {
  StudyResults results{.name = study.name,
                       .repetitions = study.repetitions,
                       .threads = options.threads,
                       .at = study.at,
                       .inputs = {},
                       .settings = study.settings,
                       .results = {}};
  for (const StudyInput& input : study.inputs) results.inputs.push_back({input.name, 0});
  for (const StudyCell& cell : outcome.cells) {
    StudyResult result{.input = cell.input,
                       .setting = cell.setting,
                       .failure = cell.failure,
                       .metrics = summaries_of(cell, study.at),
                       .errors = {},
                       .builds = {}};
    if (const Measured* measured = cell.measured()) result.errors = measured->errors;
    for (const StudyRun& run : cell.runs) {
      result.builds.push_back(run.build);
      results.inputs[cell.input].points = static_cast<double>(run.points);
    }
    results.results.push_back(std::move(result));
  }
  std::stable_sort(results.results.begin(), results.results.end(),
                   [](const StudyResult& a, const StudyResult& b) { return a.input < b.input; });
  return results;
}

std::vector<MetricSummary> all_metrics(const StudyResults& results) {
  std::vector<MetricSummary> all;
  for (const StudyResult& result : results.results)
    for (const MetricSummary& metric : result.metrics)
      if (std::none_of(all.begin(), all.end(),
                       [&](const auto& m) { return m.name == metric.name; }))
        all.push_back(metric);
  return all;
}

std::vector<std::string> varied_keys(const StudyResults& results) {
  std::vector<std::string> keys;
  for (const Setting& setting : build_settings()) {
    const std::string key(setting.key);
    const bool varies =
        std::any_of(results.settings.begin(), results.settings.end(), [&](const StudySetting& one) {
          return std::find(one.varied.begin(), one.varied.end(), key) != one.varied.end();
        });
    if (varies) keys.push_back(key);
  }
  return keys;
}

std::string setting_text(const StudySetting& setting, const std::string& key) {
  const auto given = setting.values.find(key);
  return given == setting.values.end() ? ""
                                       : fmt::format("{}", fmt::join(given->second.values, " "));
}

bool on_front(const StudyResults& results, const StudyResult& result, std::string_view cost,
              std::string_view error) {
  const auto my_cost = result.value(cost), my_error = result.value(error);
  if (!my_cost || !my_error) return false;
  return std::none_of(
      results.results.begin(), results.results.end(), [&](const StudyResult& other) {
        const auto its_cost = other.value(cost), its_error = other.value(error);
        return other.input == result.input && its_cost && its_error && *its_cost <= *my_cost &&
               *its_error <= *my_error && (*its_cost < *my_cost || *its_error < *my_error);
      });
}

}  // namespace cairn::pipeline
