// What selecting a frame's cut costs, for the trees of the paper's Table II (186,850,683 points of the St. Matthew).
#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "tests/support/random_tree.h"
#include "viewer/depth_layers.h"
#include "viewer/lod_selection.h"

namespace {

using namespace cairn::viewer;

struct Shape {
  std::uint32_t fanout;
  std::uint64_t target_points;
};

/// Rows of the table, fan-outs and VBO sizes as the numbers of nodes in it tell.
constexpr Shape kTable[] = {{6, 4009}, {6, 24029}, {3, 85437}, {7, 77822}, {8, 364943}};
constexpr PictureSize kSize{1024, 1024};

/// Cameras on a way from far outside into the middle of the scene.
std::vector<View> approach(const Box& scene) {
  std::vector<View> views;
  const Camera start = camera_around(scene, kSize);
  for (int step = 0; step < 16; ++step) {
    Camera camera = start;
    camera.eye += (step / 16.0) * (camera.target - camera.eye);
    views.emplace_back(camera, kSize, 1e-3);
  }
  return views;
}

void select_on_budget(benchmark::State& state) {
  const Shape shape = kTable[state.range(0)];
  std::mt19937_64 random(1);
  const LodTree tree = cairn::tests::make_random_tree({.points = 186'850'683,
                                                       .fanout = shape.fanout,
                                                       .target_points = shape.target_points,
                                                       .cones = state.range(2) != 0},
                                                      random);
  const std::vector<View> views = approach(tree.node(0).box);
  const SelectionLimits limits{.points = static_cast<std::uint64_t>(state.range(1)),
                               .cull_back_faces = state.range(2) != 0};
  std::size_t frame = 0;
  std::uint64_t nodes = 0;
  for (auto _ : state) {
    const Selection cut = select(tree, views[frame++ % views.size()], limits);
    nodes += cut.nodes.size();
    benchmark::DoNotOptimize(cut.points);
  }
  state.counters["tree"] = tree.size();
  state.counters["used"] = static_cast<double>(nodes) / static_cast<double>(state.iterations());
}

void tables(benchmark::internal::Benchmark* bench) {
  for (int row = 0; row < 5; ++row)
    for (const int budget : {3'000'000, 12'000'000})
      for (const int cones : {0, 1}) bench->Args({row, budget, cones});
}
BENCHMARK(select_on_budget)
    ->Apply(tables)
    ->ArgNames({"row", "budget", "cones"})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
