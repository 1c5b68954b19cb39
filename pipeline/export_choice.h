// Which points of a dataset are exported, as the flags of `cairn export` tell it.
#pragma once

#include <optional>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "stages/export.h"

namespace cairn::pipeline {

/// The flags as they are given; empty: not at all.
struct ExportFlags {
  std::string level;   ///< "leaves" or a number
  std::string box;     ///< MINX,MINY,MINZ,MAXX,MAXY,MAXZ
  std::string budget;  ///< points, as parse_count takes them
  std::string around;  ///< X,Y,Z
  std::optional<double> radius;

  bool choose_part() const {
    return !level.empty() || !box.empty() || !budget.empty() || !around.empty() || radius;
  }
};

struct ExportChoice {
  stages::ExportSelection selection;
  std::string title;  ///< "level 2", "levels 0 to 3"
  /// World units, of a cut on a budget: no input point of its regions is farther from the point that stands for it.
  std::optional<double> bound;
};

/// Throws Error (kUsage) for flags that are no such texts, that contradict each other, for a level that there is not, for a
/// box that holds nothing of the dataset and a budget that is too small.
ExportChoice choose_export(const formats::DatasetReader& dataset, const ExportFlags& flags);

}  // namespace cairn::pipeline
