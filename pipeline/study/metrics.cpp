#include "pipeline/study/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "pipeline/human.h"
#include "pipeline/point_count.h"

namespace cairn::pipeline {
namespace {

using stages::LevelError;
using stages::SurfaceError;

/// What a cut between two levels has of their errors.
enum class Mixing { kMean, kMeanSquare, kGreater };

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct LevelMetric {
  std::string_view name;
  Mixing mixing;
  double (*of)(const LevelError& level);
  double of_leaves = 0;
};

template <typename Of>
double of_surface(const LevelError& level, Of of) {
  return level.geometry.surface ? of(*level.geometry.surface) : kNotMeasured;
}

// To add an error of levels: a row here, and one below if it is no plain number.
constexpr auto kLevelMetrics = std::to_array<LevelMetric>({
    {"rms", Mixing::kMeanSquare, [](const LevelError& level) { return level.rms; }},
    {"percentile_99", Mixing::kGreater,
     [](const LevelError& level) { return level.percentile_99; }},
    {"largest", Mixing::kGreater, [](const LevelError& level) { return level.largest; }},
    {"nearest_rms", Mixing::kMeanSquare,
     [](const LevelError& level) {
       return of_surface(level, [](const SurfaceError& error) { return error.nearest.rms; });
     }},
    {"uncovered", Mixing::kMean,
     [](const LevelError& level) {
       return of_surface(level, [](const SurfaceError& error) { return error.uncovered; });
     }},
    {"overdraw", Mixing::kMean,
     [](const LevelError& level) {
       return of_surface(level, [](const SurfaceError& error) { return error.overdraw; });
     },
     /*of_leaves=*/kNotMeasured},
});

struct KnownMetric {
  std::string_view name;
  MetricInfo info;
};

// Names that do not tell their unit by a suffix. All others are plain numbers, the smaller the better.
constexpr auto kKnownMetrics = std::to_array<KnownMetric>({
    {"rms", {.dimension = Dimension::kLength}},
    {"percentile_99", {.dimension = Dimension::kLength}},
    {"largest", {.dimension = Dimension::kLength}},
    {"nearest_rms", {.dimension = Dimension::kLength}},
    {"uncovered", {.dimension = Dimension::kShare}},
    {"holes", {.dimension = Dimension::kShare}},
    {"bytes_per_point", {.dimension = Dimension::kBytes}},
    {"build_s_per_M", {.dimension = Dimension::kTime}},
    {"psnr", {.more_is_better = true}},
    {"ssim", {.more_is_better = true}},
});

constexpr auto kLevelMetricNames = [] {
  std::array<std::string_view, kLevelMetrics.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kLevelMetrics[i].name;
  return names;
}();

/// A number with the factor that its suffix stands for; nothing for any other text.
std::optional<double> number_before(std::string_view text, std::string_view suffix, double factor) {
  if (!text.ends_with(suffix)) return std::nullopt;
  text.remove_suffix(suffix.size());
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value > 0 ? std::optional(value * factor) : std::nullopt;
}

/// The leaves, then the levels above them.
double points_of(const ErrorCurve& curve, std::size_t above_leaves) {
  return above_leaves == 0 ? curve.leaf_points : curve.levels[above_leaves - 1].points;
}

double linear(double at_0, double at_1, double t) { return (1 - t) * at_0 + t * at_1; }

std::optional<double> if_measured(double error) {
  return std::isnan(error) ? std::nullopt : std::optional(error);
}

double error_of(const ErrorCurve& curve, std::size_t above_leaves, std::size_t metric) {
  return above_leaves == 0 ? kLevelMetrics[metric].of_leaves
                           : curve.levels[above_leaves - 1].errors[metric];
}

}  // namespace

MetricInfo metric_info(std::string_view name) {
  const std::string_view base = name.substr(0, name.find('@'));
  for (const KnownMetric& known : kKnownMetrics)
    if (known.name == base) return known.info;
  if (base.ends_with("_ms")) return {.dimension = Dimension::kTime, .unit = 1e-3};
  if (base.ends_with("_s")) return {.dimension = Dimension::kTime};
  if (base.ends_with("_bytes")) return {.dimension = Dimension::kBytes};
  return {};
}

std::span<const std::string_view> level_metrics() { return kLevelMetricNames; }

ErrorCurve error_curve(const stages::ErrorReport& report) {
  ErrorCurve curve{.leaf_points = static_cast<double>(report.leaf_points), .levels = {}};
  for (auto level = report.levels.rbegin(); level != report.levels.rend(); ++level) {
    LevelErrors errors{.points = static_cast<double>(level->points), .errors = {}};
    for (const LevelMetric& metric : kLevelMetrics) errors.errors.push_back(metric.of(*level));
    curve.levels.push_back(std::move(errors));
  }
  return curve;
}

std::optional<ErrorPlace> parse_place(std::string_view text) {
  using enum ErrorPlace::Unit;
  if (const auto share = number_before(text, "%", 0.01))
    return *share <= 1 ? std::optional<ErrorPlace>({kShare, *share}) : std::nullopt;
  if (text.ends_with('k') || text.ends_with('K') || text.ends_with('M')) {
    const auto points = parse_count(text);
    return points ? std::optional<ErrorPlace>({kPoints, static_cast<double>(*points)})
                  : std::nullopt;
  }
  const auto level = number_before(text, "", 1);
  if (!level || *level != std::floor(*level) || *level > 60) return std::nullopt;
  return ErrorPlace{kLevelsAboveLeaves, *level};
}

std::string place_words(const ErrorPlace& place) {
  if (place.unit == ErrorPlace::Unit::kShare)
    return significant(100 * place.value, 6) + " % of the points drawn";
  const std::string count = with_commas(static_cast<std::uint64_t>(std::llround(place.value)));
  if (place.unit == ErrorPlace::Unit::kPoints) return count + " points drawn";
  return count + (place.value == 1 ? " level" : " levels") + " above the leaves";
}

std::optional<double> points_at(const ErrorCurve& curve, const ErrorPlace& place) {
  if (place.unit == ErrorPlace::Unit::kLevelsAboveLeaves) {
    const auto level = static_cast<std::size_t>(place.value);
    return level <= curve.levels.size() ? std::optional(points_of(curve, level)) : std::nullopt;
  }
  const double asked =
      place.unit == ErrorPlace::Unit::kShare ? place.value * curve.leaf_points : place.value;
  const double points = std::min(asked, curve.leaf_points);
  return points >= points_of(curve, curve.levels.size()) ? std::optional(points) : std::nullopt;
}

std::optional<double> error_at(const ErrorCurve& curve, std::string_view name,
                               const ErrorPlace& place) {
  const auto metric =
      static_cast<std::size_t>(std::find(kLevelMetricNames.begin(), kLevelMetricNames.end(), name) -
                               kLevelMetricNames.begin());
  const auto points = points_at(curve, place);
  if (metric == kLevelMetricNames.size() || !points) return std::nullopt;
  // Levels double their points at least (a fan-out is 2 or more), so none is met twice.
  std::size_t coarse = 0;
  while (points_of(curve, coarse) > *points) ++coarse;
  const double error = error_of(curve, coarse, metric);
  if (points_of(curve, coarse) == *points) return if_measured(error);
  const double fine_error = error_of(curve, coarse - 1, metric);
  const double refined = (*points - points_of(curve, coarse)) /
                         (points_of(curve, coarse - 1) - points_of(curve, coarse));
  switch (kLevelMetrics[metric].mixing) {
    case Mixing::kMean:
      return if_measured(linear(error, fine_error, refined));
    case Mixing::kMeanSquare:
      return if_measured(std::sqrt(linear(error * error, fine_error * fine_error, refined)));
    case Mixing::kGreater:
      break;
  }
  return if_measured(std::isnan(error) ? error : std::max(error, fine_error));
}

}  // namespace cairn::pipeline
