#include "pipeline/study/conditions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "formats/error.h"

namespace cairn::pipeline {
namespace {

struct Unit {
  std::string_view suffix;
  double factor;
  Dimension dimension;
};

constexpr auto kUnits = std::to_array<Unit>({{"mm", 1e-3, Dimension::kLength},
                                             {"cm", 1e-2, Dimension::kLength},
                                             {"m", 1, Dimension::kLength},
                                             {"ms", 1e-3, Dimension::kTime},
                                             {"s", 1, Dimension::kTime},
                                             {"min", 60, Dimension::kTime},
                                             {"%", 1e-2, Dimension::kShare}});

[[noreturn]] void refuse(std::string_view asked, const std::string& why) {
  formats::throw_usage(
      fmt::format("cannot take '{}' as a condition: {}; one reads 'rms <= 2mm' or "
                  "'rms@10% < 0.01, bytes_per_point <= 6'",
                  asked, why));
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\n") + 1 - begin);
}

/// The number at the beginning of a text, which is taken off; nothing if there is none above 0.
std::optional<double> take_number(std::string_view& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value) || !(value > 0)) return std::nullopt;
  text = trimmed(text.substr(static_cast<std::size_t>(end - text.data())));
  return value;
}

/// What a suffix stands for, in the unit of the metric.
std::optional<double> factor_of(std::string_view suffix, const std::string& metric) {
  const MetricInfo info = metric_info(metric);
  if (suffix.empty() || (suffix == "dB" && metric.starts_with("psnr"))) return 1;
  for (const Unit& unit : kUnits)
    if (unit.suffix == suffix && unit.dimension == info.dimension) return unit.factor / info.unit;
  return std::nullopt;
}

Condition parse_condition(std::string_view text) {
  const std::size_t sign = text.find_first_of("<>=");
  if (sign == std::string_view::npos) refuse(text, "there is no <=, <, >= or >");
  Condition condition{.text = std::string(text),
                      .metric = std::string(trimmed(text.substr(0, sign)))};
  condition.at_least = text[sign] == '>';
  condition.strict = sign + 1 == text.size() || text[sign + 1] != '=';
  if (condition.metric.empty()) refuse(text, "it names no metric");
  if (text[sign] == '=') refuse(text, "there is no <=, <, >= or >");
  std::string_view rest = trimmed(text.substr(sign + (condition.strict ? 1 : 2)));
  const auto number = take_number(rest);
  if (!number) refuse(text, "the limit is no number above 0");
  const auto factor = factor_of(rest, condition.metric);
  if (!factor) refuse(text, fmt::format("'{}' is no unit of {}", rest, condition.metric));
  condition.limit = *number * *factor;
  if (condition.at_least != metric_info(condition.metric).more_is_better)
    refuse(text, fmt::format("{} is the better the {} it is", condition.metric,
                             condition.at_least ? "smaller" : "larger"));
  return condition;
}

}  // namespace

bool Condition::holds(double value) const {
  if (at_least) return strict ? value > limit : value >= limit;
  return strict ? value < limit : value <= limit;
}

double Condition::excess(double value) const { return at_least ? limit / value : value / limit; }

std::vector<Condition> parse_conditions(std::string_view text) {
  std::string parts(text);
  for (std::size_t at = parts.find(" and "); at != std::string::npos; at = parts.find(" and "))
    parts.replace(at, 5, ",");
  std::replace(parts.begin(), parts.end(), ';', ',');
  std::vector<Condition> conditions;
  for (std::string_view rest = parts;;) {
    const std::size_t comma = rest.find(',');
    conditions.push_back(parse_condition(trimmed(rest.substr(0, comma))));
    if (comma == std::string_view::npos) return conditions;
    rest.remove_prefix(comma + 1);
  }
}

Condition parse_within(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto refuse_it = [&] {
    formats::throw_usage(
        fmt::format("cannot take '{}' as a time for a number of points: expected one such as "
                    "'60s/100M', '500ms/1M' or '5min/1000M'",
                    text));
  };
  if (slash == std::string_view::npos) refuse_it();
  std::string_view time = trimmed(text.substr(0, slash));
  const auto seconds = take_number(time);
  const auto factor = factor_of(time, "build_s");
  const auto points = parse_place(trimmed(text.substr(slash + 1)));
  if (!seconds || !factor || time.empty() || !points || points->unit != ErrorPlace::Unit::kPoints)
    refuse_it();
  return {.text = fmt::format("a build within {}", trimmed(text)),
          .metric = kPace,
          .limit = 1e6 * *seconds * *factor / points->value};
}

void require_known(const std::vector<Condition>& conditions, const StudyResults& results) {
  std::string names;
  for (const MetricSummary& metric : all_metrics(results))
    names += (names.empty() ? "" : ", ") + metric.name;
  for (const Condition& condition : conditions) {
    const bool is_known = std::any_of(
        results.results.begin(), results.results.end(),
        [&](const StudyResult& result) { return result.value(condition.metric).has_value(); });
    if (!is_known)
      formats::throw_usage(fmt::format(
          "no result has '{}'; there are {}, and the errors of levels as rms@2, rms@10% "
          "or rms@200k",
          condition.metric, names));
  }
}

}  // namespace cairn::pipeline
