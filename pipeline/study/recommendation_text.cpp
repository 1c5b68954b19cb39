#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/human.h"
#include "pipeline/study/recommend.h"

namespace cairn::pipeline {
namespace {

constexpr std::size_t kMostOthers = 5;

/// A value as a configuration file has it. The escapes of a JSON string are escapes of TOML too.
std::string toml_value(const Setting& setting, const std::vector<std::string>& values) {
  const auto quoted = [](const std::string& text) { return nlohmann::json(text).dump(); };
  if (setting.kind == SettingKind::kTexts) {
    std::string list;
    for (const std::string& value : values) list += (list.empty() ? "" : ", ") + quoted(value);
    return "[" + list + "]";
  }
  const bool is_text = setting.kind == SettingKind::kText || values.front() == "auto";
  return is_text ? quoted(values.front()) : values.front();
}

const StudyResult& result_of(const StudyResults& results, std::size_t input, std::size_t setting) {
  const auto at =
      std::find_if(results.results.begin(), results.results.end(),
                   [&](const StudyResult& r) { return r.input == input && r.setting == setting; });
  return *at;
}

std::string text_of(std::optional<double> value) {
  return value ? significant(*value, 4) : "not known";
}

std::string minimized_words(const std::string& minimized) {
  return minimized == kPace ? "build time, seconds a million points" : minimized;
}

/// What a condition without more words is about: where errors are told, what a pace takes for granted.
std::string place_note(const StudyResults& results, const Condition& condition) {
  if (condition.metric == kPace)
    return ": seconds a million points, time being taken to grow as the points do";
  const std::size_t sign = condition.metric.find('@');
  const std::string name = condition.metric.substr(0, sign);
  const auto all = level_metrics();
  if (std::find(all.begin(), all.end(), name) == all.end()) return "";
  const auto place = sign == std::string::npos ? std::optional(results.at)
                                               : parse_place(condition.metric.substr(sign + 1));
  const bool is_length = metric_info(name).dimension == Dimension::kLength;
  return ": " + name + " at " + place_words(*place) +
         (is_length ? ", in units of the coordinates" : "");
}

/// What the chosen setting measured on each input, beside the limit.
std::string measured_lines(const StudyResults& results, const Condition& condition,
                           std::size_t setting) {
  std::string text;
  for (std::size_t i = 0; i < results.inputs.size(); ++i) {
    const double value = *result_of(results, i, setting).value(condition.metric);
    text += fmt::format("#     {:<20} {:>10}   {:.0f} % of the limit, {}\n", results.inputs[i].name,
                        significant(value, 4), 100 * value / condition.limit,
                        significant(condition.limit, 4));
  }
  return text;
}

/// Why a setting is not recommended: "rms 2.4 on input1".
std::string shortcoming(const StudyResults& results, const std::vector<Condition>& conditions,
                        const std::string& minimized, const Candidate& candidate) {
  const bool unknown = candidate.unknown_input.has_value();
  const std::size_t input = unknown ? *candidate.unknown_input : candidate.worst_input;
  const std::string& metric = unknown ? minimized : conditions[candidate.worst_condition].metric;
  const auto value = result_of(results, input, candidate.setting).value(metric);
  return fmt::format("{} {} on {}", metric, text_of(value), results.inputs[input].name);
}

std::string others(const StudyResults& results, const std::vector<Condition>& conditions,
                   const std::string& minimized, const std::vector<Candidate>& ranked) {
  std::string text = ranked.size() > 1 ? "#\n# Other settings:\n" : "";
  const std::size_t end = std::min(ranked.size(), kMostOthers + 1);
  std::size_t width = 0;
  for (std::size_t i = 1; i < end; ++i)
    width = std::max(width, results.settings[ranked[i].setting].label.size());
  for (std::size_t i = 1; i < end; ++i) {
    const Candidate& other = ranked[i];
    text += fmt::format("#   {:<{}} {:>8}   ", results.settings[other.setting].label, width,
                        std::isfinite(other.cost) ? significant(other.cost, 3) : "-");
    text += other.meets
                ? "meets all\n"
                : fmt::format("no: {}\n", shortcoming(results, conditions, minimized, other));
  }
  if (ranked.size() > kMostOthers + 1)
    text += fmt::format("#   and {} more\n", ranked.size() - 1 - kMostOthers);
  return text;
}

bool has_zero(const StudyResults& results, const std::string& minimized, std::size_t setting) {
  return std::ranges::any_of(results.results, [&](const StudyResult& result) {
    return result.setting == setting && result.value(minimized) == 0.0;
  });
}

}  // namespace

std::string recommendation_toml(const StudyResults& results,
                                const std::vector<Condition>& conditions,
                                const std::string& minimized,
                                const std::vector<Candidate>& ranked) {
  const Candidate& best = ranked.front();
  const StudySetting& setting = results.settings[best.setting];
  std::string text = fmt::format(
      "# Chosen by cairn study, of {} on {}: {}.\n"
      "#\n#   cairn build SCANS --config THIS_FILE -o NAME.cairn\n#\n",
      count_of(results.settings.size(), "setting"), count_of(results.inputs.size(), "input"),
      setting.label);
  for (const Condition& condition : conditions)
    text += fmt::format("# Asked for {}{}.\n# Measured on each input:\n{}", condition.text,
                        place_note(results, condition),
                        measured_lines(results, condition, best.setting));
  text += fmt::format(
      "#\n# Of the settings that meet this on all inputs it has the least {}:\n"
      "# {}, the geometric mean over the inputs{}. Times are medians of {} with {}.\n",
      minimized_words(minimized), significant(best.cost, 3),
      has_zero(results, minimized, best.setting) ? " where it is above 0 with some setting" : "",
      count_of(results.repetitions, "repetition"), count_of(results.threads, "thread"));
  text += others(results, conditions, minimized, ranked);
  text +=
      "#\n# Errors and sizes go with the density of the scans, times with the machine and about "
      "with "
      "the number of points:\n"
      "# this holds for scans like those of the study. Suffixes such as mm take world units for "
      "meters.\n\n";
  for (const auto& [key, given] : setting.values)
    text += fmt::format("{} = {}\n", key, toml_value(*find_setting(key), given.values));
  return text;
}

std::string nothing_found(const StudyResults& results, const std::vector<Condition>& conditions,
                          const std::string& minimized, const std::vector<Candidate>& ranked) {
  const Candidate& nearest = ranked.front();
  const std::string words = shortcoming(results, conditions, minimized, nearest);
  if (nearest.unknown_input)
    return fmt::format(
        "nothing can be recommended, since with every setting {} is not known of some input: {}",
        minimized, words);
  return fmt::format("no setting meets '{}' on all inputs; nearest is '{}', with {}",
                     conditions[nearest.worst_condition].text,
                     results.settings[nearest.setting].label, words);
}

}  // namespace cairn::pipeline
