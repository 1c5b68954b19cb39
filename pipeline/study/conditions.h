// What is asked of a setting: "rms <= 2mm and bytes_per_point < 6".
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/study/study_results.h"

namespace cairn::pipeline {

/// The metric of build times that does not depend on how many points there are.
inline constexpr const char* kPace = "build_s_per_M";

struct Condition {
  std::string text;    ///< as it was asked
  std::string metric;  ///< as StudyResult::value takes it
  bool at_least = false;
  bool strict = false;
  double limit = 0;  ///< above 0, in the metric's own unit

  bool holds(double value) const;
  /// How many times beyond its limit a value is; up to 1 where the condition holds, apart from strict ones.
  double excess(double value) const;
};

/// One or more, separated by commas, semicolons or "and". A length may have the suffix mm, cm or m, which takes world
/// units for meters; a time ms, s or min; a share %; psnr dB. Throws kUsage, naming what is wrong, for what cannot be
/// read, for a suffix of another dimension, and for a bound on the wrong side, such as "rms >= 1".
std::vector<Condition> parse_conditions(std::string_view text);

/// A time for a number of points: "60s/100M". Says that a build takes so long at most, time growing as the points do.
/// Throws kUsage.
Condition parse_within(std::string_view text);

/// Throws kUsage, naming those that are known, where a condition's metric is none that the results have.
void require_known(const std::vector<Condition>& conditions, const StudyResults& results);

}  // namespace cairn::pipeline
