#include "formats/scans/position_map.h"

#include <algorithm>
#include <cmath>

namespace cairn::formats {
namespace {

/// Beyond this a double cannot tell neighbouring whole numbers.
constexpr double kLargestWhole = 9007199254740992.0;  // 2^53
/// Relative rounding of a decimal fraction as a double, and of one operation on doubles.
constexpr double kRounding = 1.0 / kLargestWhole;
/// Grid steps that no position may be off by, unless the rounding of scales alone explains it.
constexpr double kStepTolerance = 1e-3;

std::optional<std::int64_t> whole_number(double value, double tolerance) {
  const double nearest = std::round(value);
  if (!(std::fabs(value - nearest) <= tolerance) || std::fabs(nearest) > kLargestWhole)
    return std::nullopt;
  return static_cast<std::int64_t>(nearest);
}

/// Any int32 may multiply the factor, and its error with it. Three roundings, of both scales and of their
/// ratio, are less than a millionth of a scan step even then.
std::optional<std::int64_t> whole_factor(double scan_scale, double grid_step) {
  const double ratio = scan_scale / grid_step;
  return whole_number(ratio, std::max(kStepTolerance / 2147483648.0, 3 * kRounding * ratio));
}

/// A millionth of a step, more where offsets are so large that their own rounding shows.
std::optional<std::int64_t> whole_addend(double scan_offset, double grid_offset, double grid_step) {
  const double steps = (scan_offset - grid_offset) / grid_step;
  const double rounding =
      kRounding *
      ((std::fabs(scan_offset) + std::fabs(grid_offset)) / grid_step + 3 * std::fabs(steps));
  return whole_number(steps, std::clamp(rounding, 1e-6, kStepTolerance));
}

}  // namespace

std::optional<AxisFit> fit_axis(double scan_scale, double scan_offset, double grid_step,
                                double grid_offset) {
  const auto factor = whole_factor(scan_scale, grid_step);
  const auto addend = whole_addend(scan_offset, grid_offset, grid_step);
  // The product with an int32 must stay far from the end of int64.
  if (!factor || !addend || *factor < 1 || *factor > (std::int64_t{1} << 30)) return std::nullopt;
  return AxisFit{*factor, *addend};
}

PositionMap::PositionMap(const ScanInfo& scan, const Grid& grid)
    : encoding_(scan.encoding), scan_scale_(scan.scale), scan_offset_(scan.offset), grid_(grid) {
  if (encoding_ != PositionEncoding::kSteps) return;
  exact_ = true;
  for (std::size_t axis = 0; axis < 3 && exact_; ++axis) {
    const auto fit =
        fit_axis(scan.scale[axis], scan.offset[axis], grid.step[axis], grid.offset[axis]);
    exact_ = fit.has_value();
    if (!fit) break;
    factor_[axis] = fit->factor;
    addend_[axis] = fit->addend - grid.shift[axis];
  }
}

double PositionMap::steps(std::size_t axis, double native) const {
  const double world = encoding_ == PositionEncoding::kSteps
                           ? scan_offset_[axis] + scan_scale_[axis] * native
                           : native;
  return (world - grid_.offset[axis]) / grid_.step[axis];
}

std::array<double, 3> PositionMap::rounded_off(const std::byte* bytes,
                                               const GridPoint& mapped) const {
  if (exact_) return {0, 0, 0};
  std::array<double, 3> off;
  for (std::size_t axis = 0; axis < 3; ++axis)
    off[axis] = steps(axis, native(bytes, axis)) -
                static_cast<double>(std::int64_t{mapped[axis]} + grid_.shift[axis]);
  return off;
}

std::int32_t PositionMap::round(std::size_t axis, double native) const {
  const double steps = this->steps(axis, native);
  if (!(std::fabs(steps) < 9.0e18)) return steps < 0 ? INT32_MIN : INT32_MAX;
  const std::int64_t shifted = std::llround(steps);
  std::int64_t result;
  if (__builtin_sub_overflow(shifted, grid_.shift[axis], &result))
    return steps < 0 ? INT32_MIN : INT32_MAX;
  return saturate(result);
}

GridPoint PositionMap::map(const std::array<double, 3>& native) const {
  GridPoint out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (exact_)
      out[axis] = saturate(static_cast<std::int64_t>(native[axis]) * factor_[axis] + addend_[axis]);
    else
      out[axis] = round(axis, native[axis]);
  }
  return out;
}

}  // namespace cairn::formats
