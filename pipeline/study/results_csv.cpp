#include <fmt/format.h>

#include "pipeline/study/results_files.h"

namespace cairn::pipeline {
namespace {

/// RFC 4180, section 2: what holds a comma, a quote or a line break stands in quotes, each of its quotes doubled.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::string results_csv(const StudyResults& results) {
  const std::vector<std::string> keys = varied_keys(results);
  const std::vector<MetricSummary> metrics = all_metrics(results);
  std::string text = "input,points,setting";
  for (const std::string& key : keys) text += "," + key;
  for (const MetricSummary& metric : metrics)
    text += metric.repeated ? fmt::format(",{0},{0}_min,{0}_max", metric.name) : "," + metric.name;
  text += "\r\n";
  for (const StudyResult& result : results.results) {
    const StudySetting& setting = results.settings[result.setting];
    const StudyResults::Input& input = results.inputs[result.input];
    text += fmt::format("{},{:.0f},{}", field(input.name), input.points, field(setting.label));
    for (const std::string& key : keys) text += "," + field(setting_text(setting, key));
    for (const MetricSummary& metric : metrics) {
      const MetricSummary* own = result.find(metric.name);
      if (own == nullptr)
        text += metric.repeated ? ",,," : ",";
      else
        text += metric.repeated ? fmt::format(",{},{},{}", own->median, own->min, own->max)
                                : fmt::format(",{}", own->median);
    }
    text += "\r\n";
  }
  return text;
}

}  // namespace cairn::pipeline
