// Datasets of points in memory, made by the stages one after the other.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/dataset/grid.h"
#include "stages/cluster/reducer.h"
#include "stages/context.h"

namespace cairn::test {

struct SmallBuild {
  std::vector<formats::GridPoint> points;  ///< in steps of `scale`
  std::array<double, 3> scale{1, 1, 1};
  std::array<double, 3> offset{0, 0, 0};
  std::vector<std::array<float, 3>> normals{};  ///< one a point, or none
  std::vector<float> radii{};                   ///< one a point, or none
  std::uint32_t fanout = 4;
  std::uint64_t node_points = 100;
  std::string reducer = "cluster";
  stages::ClusterOptions clustering{};
};

/// Writes the dataset, its leaves without loss, into a new folder.
void write_built(const SmallBuild& build, const std::filesystem::path& folder,
                 stages::Context& context);

}  // namespace cairn::test
