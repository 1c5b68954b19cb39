// How a scan's positions become steps of a dataset's grid.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "formats/bytes.h"
#include "formats/dataset/grid.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// How an axis of LAS steps lies on a grid axis: grid step + shift = factor * scan step + addend.
struct AxisFit {
  std::int64_t factor;
  std::int64_t addend;
};

/// The fit of LAS steps of `scan_scale` from `scan_offset`, if they are whole grid steps. Scales and offsets
/// are decimal fractions rounded to doubles, so what their rounding explains counts as whole, and so does
/// what moves no int32 position by more than about a thousandth of a grid step.
std::optional<AxisFit> fit_axis(double scan_scale, double scan_offset, double grid_step,
                                double grid_offset);

/// How positions of one scan become grid steps; a pure function of the scan's header and the grid.
class PositionMap {
 public:
  PositionMap(const ScanInfo& scan, const Grid& grid);

  PositionEncoding encoding() const { return encoding_; }
  /// True if mapping is a whole-number shift of multiples: nothing is rounded.
  bool exact() const { return exact_; }
  /// True if the scan's steps are the grid's.
  bool same() const {
    return exact_ && factor_ == std::array<std::int64_t, 3>{1, 1, 1} &&
           addend_ == std::array<std::int64_t, 3>{0, 0, 0};
  }

  /// Maps the position stored at `bytes` in the scan's encoding. Coordinates beyond int32 saturate; a
  /// grid that was chosen for the scan has none.
  GridPoint map(const std::byte* bytes) const {
    GridPoint out;
    for (std::size_t axis = 0; axis < 3; ++axis) out[axis] = map_axis(bytes, axis);
    return out;
  }
  GridPoint map(const std::array<double, 3>& native) const;
  /// What was rounded off when the position at `bytes` was mapped to `mapped`: grid steps, half a step at most, none if
  /// the map is exact.
  std::array<double, 3> rounded_off(const std::byte* bytes, const GridPoint& mapped) const;

 private:
  std::int32_t map_axis(const std::byte* bytes, std::size_t axis) const {
    if (!exact_) return round(axis, native(bytes, axis));
    const auto step = load_le<std::int32_t>(bytes + 4 * axis);
    return saturate(static_cast<std::int64_t>(step) * factor_[axis] + addend_[axis]);
  }
  double native(const std::byte* bytes, std::size_t axis) const {
    switch (encoding_) {
      case PositionEncoding::kSteps:
        return load_le<std::int32_t>(bytes + 4 * axis);
      case PositionEncoding::kFloat32:
        return static_cast<double>(load_le<float>(bytes + 4 * axis));
      case PositionEncoding::kFloat64:
        return load_le<double>(bytes + 8 * axis);
    }
    return 0;
  }
  /// Grid steps from the grid's offset, before rounding.
  double steps(std::size_t axis, double native) const;
  std::int32_t round(std::size_t axis, double native) const;
  static std::int32_t saturate(std::int64_t steps) {
    if (steps < INT32_MIN) return INT32_MIN;
    if (steps > INT32_MAX) return INT32_MAX;
    return static_cast<std::int32_t>(steps);
  }

  PositionEncoding encoding_;
  bool exact_ = false;
  std::array<std::int64_t, 3> factor_{1, 1, 1};  ///< exact: grid step = factor * scan step + addend
  std::array<std::int64_t, 3> addend_{0, 0, 0};
  std::array<double, 3> scan_scale_;
  std::array<double, 3> scan_offset_;
  Grid grid_;
};

}  // namespace cairn::formats
