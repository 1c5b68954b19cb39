// How far on the screen a cut draws each point from where it belongs, measured: a leaf's points are followed, by the
// representatives that the dataset stores, to the points that the cut draws for them. Nothing of it is the viewer's
// but the cut and the bounds that it told, which are what is held against the measurement.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "viewer/lod_selection.h"

namespace cairn::test {

/// What was drawn, and what was promised of it.
struct Cut {
  viewer::Selection selection;
  /// Pixels: what blocks of inner nodes were selected for; infinite if for something else.
  double pixel_error = std::numeric_limits<double>::infinity();
};

/// Of all leaf points that the picture shows or that others hide in it.
struct Displacement {
  std::uint64_t points = 0;  ///< in the picture, below the cut
  std::uint64_t uncovered =
      0;  ///< in the picture, but below no block of the cut: those that a cut culls
  std::uint64_t covered_twice = 0;
  std::uint64_t above = 0;  ///< farther from the point drawn than was promised
  /// Whose drawn point lies before the near plane; right where a block's bound is infinite, and not in the sums.
  std::uint64_t lost = 0;
  double max = 0;          ///< pixels
  double sum = 0;          ///< pixels
  double sum_squares = 0;  ///< pixels^2
  double worst_share = 0;  ///< largest displacement as a share of its block's bound

  double mean() const;
  double rms() const;
};

/// Measures cuts of one view, in one walk over the dataset that holds no more than one node a level. The promise
/// of a point is the least of its block's projected bound, the bound that the selection told and, in inner nodes,
/// the pixel error. These are about input points; a decoded leaf point is itself off by at most its leaf's bound,
/// which is allowed on top. Throws Error as DatasetReader::read_node does.
std::vector<Displacement> measure_displacement(const formats::DatasetReader& dataset,
                                               const viewer::LodTree& tree,
                                               const viewer::View& view, std::span<const Cut> cuts);

}  // namespace cairn::test
