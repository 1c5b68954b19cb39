#include "pipeline/stage_options.h"

#include <algorithm>

namespace cairn::pipeline {

formats::Tree choose_tree(const BuildOptions& options, std::uint64_t points) {
  const std::uint32_t fanout =
      options.fanout.value_or(formats::Tree::best_fanout(points, options.node_points));
  return formats::Tree(points, fanout, options.node_points);
}

stages::EstimateOptions estimate_options(const BuildOptions& options) {
  return {.normals = options.estimate_normals,
          .radii = options.estimate_radii,
          .neighbors = options.neighbors};
}

bool estimates(const BuildOptions& options) {
  return options.estimate_normals || options.estimate_radii;
}

formats::Tree effect_blocks(std::uint64_t points) {
  constexpr std::uint64_t kBlockPoints = 16384;
  return formats::Tree(points, formats::Tree::best_fanout(points, kBlockPoints), kBlockPoints);
}

bool estimates_by_scan(const BuildOptions& options, const stages::Scans& scans) {
  // Only by its number does a point know its sensor, and only normals are turned to it.
  const bool any_sensor = std::any_of(
      scans.begin(), scans.end(), [](const auto& scan) { return scan->info().sensor.has_value(); });
  return options.estimate_normals && scans.size() > 1 && any_sensor;
}

stages::ImportOptions import_options(const BuildOptions& options, const stages::Scans& scans) {
  return {.drop = options.drop,
          .keep = options.keep,
          .resolution = options.resolution,
          .number_scans =
              estimates_by_scan(options, scans) || (options.filter.any() && scans.size() > 1)};
}

}  // namespace cairn::pipeline
