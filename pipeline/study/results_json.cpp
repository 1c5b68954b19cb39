#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/compiled_in.h"
#include "pipeline/run_json.h"
#include "pipeline/study/results_files.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json metrics_json(const StudyResult& result) {
  Json metrics = Json::object();
  for (const MetricSummary& metric : result.metrics)
    metrics[metric.name] =
        metric.repeated ? Json{{"median", metric.median}, {"min", metric.min}, {"max", metric.max}}
                        : Json(metric.median);
  return metrics;
}

Json levels_json(const ErrorCurve& curve) {
  Json levels = Json::array();
  for (std::size_t i = 0; i < curve.levels.size(); ++i) {
    Json level{{"above_leaves", i + 1},
               {"points", curve.levels[i].points},
               {"share", curve.levels[i].points / curve.leaf_points}};
    for (std::size_t m = 0; m < level_metrics().size(); ++m)
      level[std::string(level_metrics()[m])] = curve.levels[i].errors[m];
    levels.push_back(std::move(level));
  }
  return levels;
}

Json result_json(const StudyResults& results, const StudyResult& result) {
  Json builds = Json::array();
  for (const BuildReport& build : result.builds) {
    Json record = run_json(build);
    for (const char* same_for_all : {"version", "finished", "machine"}) record.erase(same_for_all);
    builds.push_back(std::move(record));
  }
  return {{"input", results.inputs[result.input].name},
          {"setting", results.settings[result.setting].label},
          {"failure", result.failure.empty() ? Json(nullptr) : Json(result.failure)},
          {"metrics", metrics_json(result)},
          {"levels", levels_json(result.errors)},
          {"builds", std::move(builds)}};
}

}  // namespace

std::string results_json(const StudyResults& results) {
  Json inputs = Json::array(), settings = Json::array(), all = Json::array();
  for (const StudyResults::Input& input : results.inputs)
    inputs.push_back({{"name", input.name}, {"points", input.points}});
  for (const StudySetting& setting : results.settings) {
    Json values = Json::object();
    for (const auto& [key, given] : setting.values) values[key] = setting_text(setting, key);
    settings.push_back({{"name", setting.label}, {"values", std::move(values)}});
  }
  for (const StudyResult& result : results.results) all.push_back(result_json(results, result));
  const Json json{{"study", results.name},
                  {"version", program_version()},
                  {"machine", machine_json()},
                  {"threads", results.threads},
                  {"repetitions", results.repetitions},
                  {"at", place_words(results.at)},
                  {"varied", varied_keys(results)},
                  {"inputs", std::move(inputs)},
                  {"settings", std::move(settings)},
                  {"results", std::move(all)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace cairn::pipeline
