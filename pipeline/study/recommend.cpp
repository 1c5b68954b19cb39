#include "pipeline/study/recommend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace cairn::pipeline {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// What 0 counts as beside values above 0, of the least of them.
constexpr double kShareOfLeast = 1e-3;

/// For each input what 0 counts as there; 0 if no setting has more. Of an input that is drawn from its leaves all settings
/// have the error 0, which tells none from another.
std::vector<double> floors_of(const StudyResults& results, const std::string& minimized) {
  std::vector<double> floors(results.inputs.size());
  for (const StudyResult& result : results.results)
    if (const double value = kShareOfLeast * result.value(minimized).value_or(0); value > 0) {
      double& floor = floors[result.input];
      floor = floor > 0 ? std::min(floor, value) : value;
    }
  return floors;
}

Candidate judge(const StudyResults& results, const std::vector<Condition>& conditions,
                const std::string& minimized, const std::vector<double>& floors,
                std::size_t setting) {
  Candidate candidate{.setting = setting, .meets = true, .unknown_input = {}};
  double logarithms = 0;
  int counted = 0;
  for (const StudyResult& result : results.results) {
    if (result.setting != setting) continue;
    const auto cost = result.value(minimized);
    candidate.meets = candidate.meets && cost;
    if (!cost) candidate.unknown_input = result.input;
    if (const double value = std::max(cost.value_or(kInfinite), floors[result.input]); value > 0) {
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
  const std::vector<double> floors = floors_of(results, minimized);
  std::vector<Candidate> ranked;
  for (std::size_t s = 0; s < results.settings.size(); ++s)
    ranked.push_back(judge(results, conditions, minimized, floors, s));
  std::stable_sort(ranked.begin(), ranked.end(), [](const Candidate& a, const Candidate& b) {
    const auto order = [](const Candidate& c) {
      return std::tuple(!c.meets, !c.meets && c.unknown_input, c.meets ? c.cost : c.excess);
    };
    return order(a) < order(b);
  });
  return ranked;
}

}  // namespace cairn::pipeline
