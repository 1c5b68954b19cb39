// Small datasets of points whose errors are then measured.
#pragma once

#include <filesystem>
#include <random>
#include <span>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/measure/measure.h"
#include "tests/support/small_build.h"
#include "tests/support/stage_fixture.h"

namespace cairn::test {

class MeasuredGeometry : public StageFixture {
 protected:
  std::filesystem::path build(const SmallBuild& build) {
    const std::filesystem::path path = folder() / ("dataset" + std::to_string(next_++));
    write_built(build, path, context());
    return path;
  }
  stages::ErrorReport measure(const std::filesystem::path& path,
                              const stages::MeasureOptions& options) {
    return stages::measure_dataset(context(), formats::DatasetReader::open(path), options);
  }
  /// Of queries that are grid points of the dataset.
  stages::ErrorReport measure_queries(const std::filesystem::path& path,
                                      const std::vector<formats::GridPoint>& queries) {
    const stages::RecordSource source = [&](const stages::RecordSink& sink) {
      sink(std::as_bytes(std::span(queries)), sizeof(formats::GridPoint));
    };
    return measure(path, {.sample = stages::MeasureOptions::kAllPoints, .against = source});
  }

 private:
  int next_ = 0;
};

/// In the cube from zero to below `range`.
inline std::vector<formats::GridPoint> random_points(std::size_t count, std::uint32_t range,
                                                     unsigned seed) {
  std::mt19937 random(seed);
  std::vector<formats::GridPoint> points(count);
  for (formats::GridPoint& p : points)
    for (std::int32_t& c : p) c = static_cast<std::int32_t>(random() % range);
  return points;
}

/// Points at random; with `normals`, a seventh of them has none.
inline SmallBuild cloud(std::size_t points, bool normals) {
  SmallBuild cloud{.points = random_points(points, 2000, 5),
                   .scale = {0.5, 0.25, 1},
                   .offset = {500'000, 5'000'000, 0},
                   .fanout = 3,
                   .node_points = 150};
  std::mt19937 random(6);
  std::uniform_real_distribution<float> component(-1, 1);
  for (std::size_t i = 0; normals && i < points; ++i)
    cloud.normals.push_back(i % 7 == 0 ? std::array<float, 3>{}
                                       : std::array{component(random), component(random), 1.0F});
  return cloud;
}

/// The corner of all points of a dataset, on its grid.
inline formats::GridPoint origin_of(const std::filesystem::path& path) {
  return formats::DatasetReader::open(path).record(formats::NodeId{0}).box.min;
}

}  // namespace cairn::test
