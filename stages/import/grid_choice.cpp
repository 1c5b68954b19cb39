#include "stages/import/grid_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/position_map.h"

namespace cairn::stages {

using formats::Grid;
using formats::PositionEncoding;
using formats::ScanInfo;

namespace {

struct StepRange {
  std::int64_t min = std::numeric_limits<std::int64_t>::max();
  std::int64_t max = std::numeric_limits<std::int64_t>::min();
};

/// Puts the smallest coordinate on step 0, or on the smallest int32 where the span needs all 32 bits.
std::optional<std::int64_t> shift_for(const StepRange& range) {
  const std::int64_t span = range.max - range.min;
  if (span <= std::numeric_limits<std::int32_t>::max()) return range.min;
  if (span <= std::numeric_limits<std::uint32_t>::max())
    return range.min - std::numeric_limits<std::int32_t>::min();
  return std::nullopt;
}

/// The grid of the scans' own scales, if they share one. A scan without a point has no say.
std::optional<Grid> common_scale_grid(std::span<const ScanExtent> scans) {
  Grid grid;
  const ScanInfo* first = nullptr;
  for (const ScanExtent& extent : scans) {
    if (extent.box.empty()) continue;
    if (extent.scan->encoding != PositionEncoding::kSteps) return std::nullopt;
    if (first == nullptr) {
      first = extent.scan;
      grid.step = first->scale;
      grid.offset = first->offset;
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      grid.step[axis] = std::min(grid.step[axis], extent.scan->scale[axis]);
  }
  if (first == nullptr) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    StepRange range;
    for (const ScanExtent& extent : scans) {
      if (extent.box.empty()) continue;
      const auto fit = formats::fit_axis(extent.scan->scale[axis], extent.scan->offset[axis],
                                         grid.step[axis], grid.offset[axis]);
      if (!fit) return std::nullopt;
      range.min = std::min(
          range.min, static_cast<std::int64_t>(extent.box.min[axis]) * fit->factor + fit->addend);
      range.max = std::max(
          range.max, static_cast<std::int64_t>(extent.box.max[axis]) * fit->factor + fit->addend);
    }
    const auto shift = shift_for(range);
    if (!shift) return std::nullopt;
    grid.shift[axis] = *shift;
  }
  return grid;
}

ScanBox world_box(std::span<const ScanExtent> scans) {
  ScanBox box;
  for (const ScanExtent& extent : scans) box.add(world_box(*extent.scan, extent.box));
  return box;
}

/// The smallest power of two that is >= value; value > 0 and finite.
double power_of_two_at_least(double value) {
  int exponent = 0;
  const double mantissa =
      std::frexp(value, &exponent);  // value = mantissa * 2^exponent, mantissa in [0.5, 1)
  return std::ldexp(1.0, mantissa == 0.5 ? exponent - 1 : exponent);
}

Grid power_of_two_grid(const ScanBox& box) {
  double extent = 0, farthest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent = std::max(extent, box.max[axis] - box.min[axis]);
    farthest = std::max({farthest, std::fabs(box.min[axis]), std::fabs(box.max[axis])});
  }
  constexpr double kSteps = (1 << 30) - 2;  // room for rounding at both ends
  double step = extent > 0 ? power_of_two_at_least(extent / kSteps) : 0;
  // Nothing is gained by steps below what a double can tell at the farthest coordinate.
  if (farthest > 0) step = std::max(step, std::ldexp(power_of_two_at_least(farthest), -53));
  if (step == 0) step = 1;
  Grid grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.step[axis] = step;
    grid.shift[axis] = std::llround(box.min[axis] / step);
  }
  return grid;
}

double longest_side(const ScanBox& box) {
  double longest = 0;
  for (std::size_t axis = 0; !box.empty() && axis < 3; ++axis)
    longest = std::max(longest, box.max[axis] - box.min[axis]);
  return longest;
}

/// The box of all scans but one.
ScanBox world_box_without(std::span<const ScanExtent> scans, std::size_t left_out) {
  ScanBox box = world_box(scans.first(left_out));
  box.add(world_box(scans.subspan(left_out + 1)));
  return box;
}

std::string shown(const ScanBox& box) {
  return fmt::format("({}, {}, {}) to ({}, {}, {})", box.min[0], box.min[1], box.min[2], box.max[0],
                     box.max[1], box.max[2]);
}

/// The step is too coarse for `finest`. Blames the scan that lies apart from the others, if without it less than
/// half of the extent is left, else the points of `finest` that stray.
[[noreturn]] void refuse_extent(std::span<const ScanExtent> scans, const ScanExtent& finest,
                                double step) {
  std::size_t apart = 0;
  for (std::size_t i = 1; i < scans.size(); ++i)
    if (longest_side(world_box_without(scans, i)) < longest_side(world_box_without(scans, apart)))
      apart = i;
  const ScanBox others = world_box_without(scans, apart);
  const bool stands_apart =
      !others.empty() && 2 * longest_side(others) < longest_side(world_box(scans));
  const std::string reason = fmt::format(
      "the campaign's extent forces a grid step of {} units, coarser than the "
      "resolution {} of {}",
      step, finest.resolution, finest.scan->name());
  if (stands_apart)
    formats::throw_input({.what = "this scan lies apart from the others, and " + reason,
                          .path = scans[apart].scan->path,
                          .found = "points from " + shown(world_box(scans.subspan(apart, 1))) +
                                   ", the others from " + shown(others),
                          .expected = "a pose that places it, or a --resolution to accept"});
  formats::throw_input({.what = reason,
                        .path = finest.scan->path,
                        .found = "points from " + shown(world_box({&finest, 1})),
                        .expected = "stray points removed, or a --resolution to accept"});
}

void require_resolution(std::span<const ScanExtent> scans, const Grid& grid,
                        std::optional<double> accepted) {
  const double step = grid.step[0];
  for (const ScanExtent& extent : scans)
    if (!extent.box.empty() && step > extent.resolution && !(accepted && step <= *accepted))
      refuse_extent(scans, extent, step);
}

/// Where the squares of distances leave the range of a double: sums of 2^48 squares of three coordinates,
/// each twice this, stay below its largest number, and the square of a step, 2^-30 of this least extent,
/// stays above its least normal one.
constexpr double kFarthest = 1e140;
constexpr double kLeastExtent = 1e-140;

void require_range(std::span<const ScanExtent> scans) {
  for (const ScanExtent& extent : scans) {
    const ScanBox box = world_box(*extent.scan, extent.box);
    for (std::size_t axis = 0; !box.empty() && axis < 3; ++axis)
      if (!(std::max(std::fabs(box.min[axis]), std::fabs(box.max[axis])) <= kFarthest))
        formats::throw_input(
            {.what = "coordinates too large for distances in doubles",
             .path = extent.scan->path,
             .found = fmt::format("from {} to {} on axis {}", box.min[axis], box.max[axis], axis),
             .expected = fmt::format("at most {}", kFarthest)});
  }
  const double longest = longest_side(world_box(scans));
  if (longest > 0 && longest < kLeastExtent)
    formats::throw_input({.what = "the campaign's extent is too small for distances in doubles",
                          .found = fmt::format("{}", longest),
                          .expected = fmt::format("0, or at least {}", kLeastExtent)});
}

}  // namespace

ScanBox world_box(const ScanInfo& scan, const ScanBox& box) {
  if (box.empty() || scan.encoding != PositionEncoding::kSteps) return box;
  ScanBox world;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    world.min[axis] = scan.offset[axis] + scan.scale[axis] * box.min[axis];
    world.max[axis] = scan.offset[axis] + scan.scale[axis] * box.max[axis];
  }
  return world;
}

void ScanBox::add(const std::array<double, 3>& p) {
  if (empty()) {
    min = max = p;
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    min[axis] = std::min(min[axis], p[axis]);
    max[axis] = std::max(max[axis], p[axis]);
  }
}

void ScanBox::add(const ScanBox& other) {
  if (other.empty()) return;
  add(other.min);
  add(other.max);
}

std::optional<Grid> common_grid(std::span<const ScanExtent> scans) {
  require_range(scans);
  return common_scale_grid(scans);
}

Grid fitted_grid(std::span<const ScanExtent> scans, std::optional<double> accepted_resolution) {
  const ScanBox box = world_box(scans);
  CAIRN_CHECK(!box.empty());
  const Grid grid = power_of_two_grid(box);
  require_resolution(scans, grid, accepted_resolution);
  return grid;
}

}  // namespace cairn::stages
