// Chooses the setting of a study that meets conditions on all of its inputs, and says why.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/study/conditions.h"
#include "pipeline/study/study_results.h"

namespace cairn::pipeline {

/// One setting, judged on all inputs.
struct Candidate {
  std::size_t setting = 0;  ///< into StudyResults::settings
  bool meets = false;  ///< every condition on every input, where also what is minimized is known
  /// Geometric mean over the inputs of what is minimized, so that each counts the same whatever its size or unit; infinite
  /// where it is not known of one. Inputs where all settings have 0 do not count, of others 0 counts as a thousandth of the
  /// least that a setting has.
  double cost = 0;
  double excess =
      0;  ///< the greatest of its conditions and inputs; infinite where one is not known
  std::size_t worst_input = 0;  ///< where it has that
  std::size_t worst_condition = 0;
  std::optional<std::size_t> unknown_input;  ///< one where what is minimized is not known
};

/// All settings: first those that meet the conditions, the cheapest first, then the others, the nearest first. Of equal
/// ones that which the study names first. `minimized` is a metric as StudyResult::value takes it.
std::vector<Candidate> rank_settings(const StudyResults& results,
                                     const std::vector<Condition>& conditions,
                                     const std::string& minimized);

/// A configuration file for `cairn build` with the best setting, which must meet the conditions, and the reasons as
/// comments.
std::string recommendation_toml(const StudyResults& results,
                                const std::vector<Condition>& conditions,
                                const std::string& minimized, const std::vector<Candidate>& ranked);

/// One line: why no setting is recommended, and which comes nearest. Requires that none meets the conditions.
std::string nothing_found(const StudyResults& results, const std::vector<Condition>& conditions,
                          const std::string& minimized, const std::vector<Candidate>& ranked);

}  // namespace cairn::pipeline
