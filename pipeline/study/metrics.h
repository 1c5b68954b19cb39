// What a study measures: named quantities, their units, and where in the tree an error is told.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stages/measure/measure.h"

namespace cairn::pipeline {

enum class Dimension { kNone, kLength, kTime, kBytes, kShare };

/// What is known of a quantity by its name, such as "rms", "cluster_s" or "psnr@200k".
struct MetricInfo {
  Dimension dimension = Dimension::kNone;
  double unit = 1;  ///< of its values, in world units, seconds or bytes: 1e-3 for milliseconds
  bool more_is_better = false;
};
MetricInfo metric_info(std::string_view name);

struct Metric {
  std::string name;
  double value = 0;
};

/// The names of the errors that every level has: "rms", "percentile_99", ...
std::span<const std::string_view> level_metrics();

/// One level, with its errors in the order of level_metrics(); NaN for one that was not measured.
struct LevelErrors {
  double points = 0;  ///< stored on the level
  std::vector<double> errors;
};

/// How errors grow with fewer points drawn.
struct ErrorCurve {
  double leaf_points = 0;
  std::vector<LevelErrors> levels;  ///< from the one above the leaves up to the root
};
ErrorCurve error_curve(const stages::ErrorReport& report);

/// Where errors are told, so that they can be compared.
struct ErrorPlace {
  enum class Unit {
    kLevelsAboveLeaves,  ///< a level of the tree
    kShare,              ///< of the leaf points drawn, 0 to 1
    kPoints,             ///< drawn
  };
  Unit unit = Unit::kLevelsAboveLeaves;
  double value = 1;
};
inline constexpr std::string_view kPlaceChoices =
    "levels above the leaves (1), a share of the points (\"10%\") or a number of points (\"200k\", "
    "\"1M\")";
std::optional<ErrorPlace> parse_place(std::string_view text);
std::string place_words(const ErrorPlace& place);  ///< "1 level above the leaves"

/// How many points are drawn there, of a dataset; nothing where that is above its root.
std::optional<double> points_at(const ErrorCurve& curve, const ErrorPlace& place);

/// An error by the name of level_metrics(); nothing above the root and where it was not measured. The leaves have none:
/// they are what all is compared with; their overdraw is not measured. Between two levels a cut refines some nodes of
/// the coarser one: what is a mean over the points (squared errors, the share that is uncovered, overdraw) is taken to
/// lie on the line between both, as it does on average over the choice of nodes, but for splats that reach into
/// neighboring nodes; of 99th percentile and largest error the greater of both levels' is told. No such cut exceeds that
/// largest error; its 99th percentile may be greater.
std::optional<double> error_at(const ErrorCurve& curve, std::string_view name,
                               const ErrorPlace& place);

}  // namespace cairn::pipeline
