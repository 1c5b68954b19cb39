// Which integer grid a campaign gets, and how a scan's positions become steps of it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/bytes.h"
#include "formats/dataset/grid.h"
#include "formats/scans/scan_reader.h"

namespace cairn::stages {

/// Exact box of a scan's kept points, in its own encoding: steps for kSteps, else world units. Doubles
/// hold both exactly. Empty while min > max.
struct ScanBox {
  std::array<double, 3> min{1, 1, 1};
  std::array<double, 3> max{0, 0, 0};
  bool empty() const { return min[0] > max[0]; }
  void add(const std::array<double, 3>& p);
  void add(const ScanBox& other);
};

struct ScanExtent {
  const formats::ScanInfo* scan = nullptr;
  ScanBox box;
  /// The finest detail that the scan can tell, world units: a LAS scale; for float input 2^-22 of the
  /// longest side of the box of its middle 99 %. Infinite where nothing is known (no points).
  double resolution = 0;
};

/// The grid that fits all scans. If every scan is on steps of one scale per axis (or whole multiples),
/// with offsets a whole number of steps apart, the grid has just those steps and import is lossless;
/// otherwise the step is the smallest power of two by which the extent fits 30 bits. The smallest
/// coordinate of an axis becomes step 0 (or the smallest int32, where the span needs 32 bits).
/// Throws Error (kInput), naming the scan and its farthest coordinates, where the step would be coarser
/// than a scan's resolution and coarser than `accepted_resolution`.
formats::Grid choose_grid(std::span<const ScanExtent> scans, std::optional<double> accepted_resolution);

/// How positions of one scan become grid steps; a pure function of the scan's header and the grid.
class PositionMap {
 public:
  PositionMap(const formats::ScanInfo& scan, const formats::Grid& grid);

  formats::PositionEncoding encoding() const { return encoding_; }
  /// True if mapping is a whole-number shift of multiples: nothing is rounded.
  bool exact() const { return exact_; }

  /// Maps the position stored at `bytes` in the scan's encoding. Coordinates beyond int32 saturate; a
  /// grid from choose_grid has none.
  formats::GridPoint map(const std::byte* bytes) const {
    formats::GridPoint out;
    for (std::size_t axis = 0; axis < 3; ++axis) out[axis] = map_axis(bytes, axis);
    return out;
  }
  formats::GridPoint map(const std::array<double, 3>& native) const;

 private:
  std::int32_t map_axis(const std::byte* bytes, std::size_t axis) const {
    switch (encoding_) {
      case formats::PositionEncoding::kSteps: {
        const auto step = formats::load_le<std::int32_t>(bytes + 4 * axis);
        return exact_ ? saturate(static_cast<std::int64_t>(step) * factor_[axis] + addend_[axis]) : round(axis, step);
      }
      case formats::PositionEncoding::kFloat32:
        return round(axis, static_cast<double>(formats::load_le<float>(bytes + 4 * axis)));
      case formats::PositionEncoding::kFloat64:
        return round(axis, formats::load_le<double>(bytes + 8 * axis));
    }
    return 0;
  }
  std::int32_t round(std::size_t axis, double native) const;
  static std::int32_t saturate(std::int64_t steps) {
    if (steps < INT32_MIN) return INT32_MIN;
    if (steps > INT32_MAX) return INT32_MAX;
    return static_cast<std::int32_t>(steps);
  }

  formats::PositionEncoding encoding_;
  bool exact_ = false;
  std::array<std::int64_t, 3> factor_{1, 1, 1};  ///< exact: grid step = factor * scan step + addend
  std::array<std::int64_t, 3> addend_{0, 0, 0};
  std::array<double, 3> scan_scale_;
  std::array<double, 3> scan_offset_;
  formats::Grid grid_;
};

}  // namespace cairn::stages
