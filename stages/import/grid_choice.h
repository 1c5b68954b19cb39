// Which integer grid a campaign gets.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

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

/// A box in a scan's own encoding as one in world units.
ScanBox world_box(const formats::ScanInfo& scan, const ScanBox& box);

struct ScanExtent {
  const formats::ScanInfo* scan = nullptr;
  ScanBox box;
  /// The finest detail that the scan can tell, world units. Of LAS its scale. Of float input 2^-22 of the longest side of
  /// the box of its middle 99 % (of the distinct coordinates, where nearly all points are one), or what its type can
  /// tell at the farthest corner of that box, whichever is coarser. Of a nominal scale as of floats, but no finer
  /// than the scale. Infinite where nothing is known (no points).
  double resolution = 0;
};

/// The grid of the scans' own steps, of which one has a point: if every scan with points is on steps of one scale per
/// axis (or whole multiples), with offsets a whole number of steps apart, the grid has just those steps and import
/// is lossless. Nothing if they share none. Resolutions are not asked for. Throws Error (kInput) where coordinates
/// beyond 1e140 or an extent below 1e-140 have squares that a double cannot hold.
std::optional<formats::Grid> common_grid(std::span<const ScanExtent> scans);

/// The grid for scans without a common one: the step is the smallest power of two by which the extent fits 30 bits.
/// Throws Error (kInput), naming the scan and its farthest coordinates, where the step would be coarser than a scan's
/// resolution and coarser than `accepted_resolution`.
///
/// Of both, the smallest coordinate of an axis becomes step 0 (or the smallest int32, where the span needs 32 bits).
formats::Grid fitted_grid(std::span<const ScanExtent> scans,
                          std::optional<double> accepted_resolution);

}  // namespace cairn::stages
