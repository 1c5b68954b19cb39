// What the index says of the nodes of each level, in figures: sizes, errors, normal thresholds, grids, bytes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"

namespace cairn::pipeline {

/// Extremes and middle of one quantity over the nodes of a level. The median of an even number is the lower of
/// the two in the middle.
struct Spread {
  double min = 0;
  double median = 0;
  double max = 0;
};

/// Nodes whose number of points lies in [min, max].
struct SizeClass {
  std::uint64_t min = 0;
  std::uint64_t max = 0;
  std::uint64_t nodes = 0;
};

struct LevelStatistics {
  std::uint64_t level = 0;
  std::uint64_t nodes = 0;
  std::uint64_t points = 0;  ///< stored
  std::uint64_t min_points = 0;
  std::uint64_t max_points = 0;
  double mean_points = 0;
  /// Standard deviation of the nodes' points over their mean; 0 where all are equal.
  double variation = 0;
  /// One class for each size that occurs, or, of more than kMostClasses sizes, as many classes of equal width.
  std::vector<SizeClass> sizes;
  Spread theta;          ///< degrees reached; all 0 on the leaf level
  Spread grid;           ///< cells along the longest axis; all 0 on the leaf level
  Spread rms;            ///< world units, a node
  Spread bound;          ///< world units, a node
  double level_rms = 0;  ///< over all input points
  std::vector<std::uint64_t> section_bytes;  ///< in the order of the sections
};

inline constexpr std::size_t kMostClasses = 32;

/// One entry a level, coarse to fine.
std::vector<LevelStatistics> level_statistics(const formats::DatasetReader& dataset);

/// Requires max >= min for every class; see LevelStatistics::sizes.
std::vector<SizeClass> size_classes(std::vector<std::uint64_t> sizes);

/// Names of the sections: position, representative, weight, radius, then the attributes.
std::vector<std::string> section_names(const formats::DatasetHeader& header);

}  // namespace cairn::pipeline
