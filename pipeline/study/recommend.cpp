#include "pipeline/study/recommend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cairn::pipeline {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Candidate judge(const StudyResults& results, const std::vector<Condition>& conditions,
                const std::string& minimized, std::size_t setting) {
  Candidate candidate{.setting = setting, .meets = true};
  double logarithms = 0;
  int counted = 0;
  for (const StudyResult& result : results.results) {
    if (result.setting != setting) continue;
    // Of an input that is drawn from its leaves all settings have the error 0: it tells none from another.
    const auto least = result.value(minimized);
    candidate.meets = candidate.meets && least;
    if (const double value = least.value_or(kInfinite); value > 0) {
      logarithms += std::log(value);
      ++counted;
    }
    for (std::size_t c = 0; c < conditions.size(); ++c) {
      const auto value = result.failure.empty() ? result.value(conditions[c].metric) : std::nullopt;
      candidate.meets = candidate.meets && value && conditions[c].holds(*value);
      const double excess = value ? conditions[c].excess(*value) : kInfinite;
      if (excess <= candidate.excess) continue;
      candidate.excess = excess;
      candidate.worst_input = result.input;
      candidate.worst_condition = c;
    }
  }
  candidate.cost = counted == 0 ? 0 : std::exp(logarithms / counted);
  return candidate;
}

}  // namespace

std::vector<Candidate> rank_settings(const StudyResults& results,
                                     const std::vector<Condition>& conditions,
                                     const std::string& minimized) {
  std::vector<Candidate> ranked;
  for (std::size_t s = 0; s < results.settings.size(); ++s)
    ranked.push_back(judge(results, conditions, minimized, s));
  std::stable_sort(ranked.begin(), ranked.end(), [](const Candidate& a, const Candidate& b) {
    const auto order = [](const Candidate& c) {
      return std::tuple(!c.meets, c.meets ? c.cost : c.excess);
    };
    return order(a) < order(b);
  });
  return ranked;
}

}  // namespace cairn::pipeline
