// Speed of the CPU renderer at 1920 x 1080 over points in memory, and of that memory: of a plain read and of a copy.
// Items are points; bytes are those of the columns that a frame reads, or of the memory read and written.
#include <benchmark/benchmark.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>
#include <vector>

#include "viewer/cpu/cpu_renderer.h"

namespace {

using namespace cairn::viewer;

constexpr std::uint32_t kPatchSide = 256;  ///< points
constexpr std::uint32_t kPatchPoints = kPatchSide * kPatchSide;
constexpr PictureSize kPicture{1920, 1080};

/// Every second bit.
std::uint32_t even_bits(std::uint32_t code) {
  std::uint32_t out = 0;
  for (int bit = 0; bit < 16; ++bit) out |= (code >> (2 * bit) & 1) << bit;
  return out;
}

enum class Order { kCurve, kRandom };

/// Hills over a square of side 16 that is cut into equal patches, one a slot; points of a patch along a space-filling
/// curve, as those of a dataset are.
class Hills {
 public:
  Hills(std::uint32_t patches_side, Order order)
      : side_(patches_side),
        renderer_({.columns = {.radius = true, .color = true, .normal = true},
                   .slots = patches_side * patches_side,
                   .slot_points = kPatchPoints}) {
    std::vector<std::uint32_t> codes(kPatchPoints);
    std::iota(codes.begin(), codes.end(), 0u);
    if (order == Order::kRandom) std::shuffle(codes.begin(), codes.end(), std::mt19937(1));
    for (std::uint32_t slot = 0; slot < renderer_.slots(); ++slot)
      renderer_.upload(slot, patch(slot, codes).columns());
  }

  CpuRenderer& renderer() { return renderer_; }

  Frame frame(const FramePlan& plan) const {
    const Camera camera{.eye = {8, 0, 8}, .target = {8, 6.5, 0}, .fov_y_degrees = 66};
    Frame frame{.view = View(camera, kPicture, 0.1), .plan = plan, .items = {}};
    for (std::uint32_t slot = 0; slot < side_ * side_; ++slot)
      frame.items.push_back({.slot = slot,
                             .count = kPatchPoints,
                             .offset = glm::vec3(glm::dvec3(corner(slot)) - camera.eye),
                             .tint = 0xffc0b0a0});
    return frame;
  }

 private:
  float patch_size() const { return 16.0f / static_cast<float>(side_); }
  glm::vec3 corner(std::uint32_t slot) const {
    return {static_cast<float>(slot % side_) * patch_size(),
            static_cast<float>(slot / side_) * patch_size(), 0};
  }

  NodePoints patch(std::uint32_t slot, const std::vector<std::uint32_t>& codes) const {
    NodePoints points;
    const float step = patch_size() / kPatchSide;
    for (const std::uint32_t code : codes) {
      const glm::vec3 at(static_cast<float>(even_bits(code)) * step,
                         static_cast<float>(even_bits(code >> 1)) * step, 0);
      const glm::vec3 world = corner(slot) + at;
      const float height = 0.5f * std::sin(world.x) * std::cos(world.y);
      const glm::vec3 normal(-0.5f * std::cos(world.x) * std::cos(world.y),
                             0.5f * std::sin(world.x) * std::sin(world.y), 1);
      points.position.push_back(at + glm::vec3(0, 0, height));
      points.radius.push_back(step);
      points.color.push_back(0xff000000 | code * 2654435761u >> 8);
      points.normal.push_back(pack_normal(glm::normalize(normal)));
    }
    return points;
  }

  std::uint32_t side_;
  CpuRenderer renderer_;
};

void draw(benchmark::State& state, Hills& hills, const FramePlan& plan) {
  const Frame frame = hills.frame(plan);
  hills.renderer().draw(frame);  // allocates
  std::uint64_t points = 0;
  for (auto _ : state) points += hills.renderer().draw(frame).points;
  // Splats are read twice: without the color to find the surface, and with it.
  const ColumnSet columns = columns_of(plan);
  std::size_t bytes = columns.point_bytes();
  if (plan.primitive == Primitive::kSplats) bytes += bytes - (columns.color ? 4 : 0);
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
  state.SetBytesProcessed(static_cast<std::int64_t>(points * bytes));
}

Hills& many_points() {
  static Hills hills(16, Order::kCurve);
  return hills;
}
Hills& one_million() {
  static Hills hills(4, Order::kCurve);
  return hills;
}

constexpr FramePlan kPoints{.primitive = Primitive::kPoints, .color = ColorSource::kColor};
constexpr FramePlan kDiscs{.primitive = Primitive::kDiscs, .color = ColorSource::kColor};
constexpr FramePlan kSplats{.primitive = Primitive::kSplats,
                            .color = ColorSource::kColor,
                            .oriented = true,
                            .lighting = true,
                            .cull_back_faces = true};

FramePlan with(FramePlan plan, bool FramePlan::*effect) {
  plan.*effect = true;
  return plan;
}

void points_16m(benchmark::State& state) { draw(state, many_points(), kPoints); }
void points_in_random_order_16m(benchmark::State& state) {
  static Hills hills(16, Order::kRandom);
  draw(state, hills, kPoints);
}
void plain_points_16m(benchmark::State& state) { draw(state, many_points(), FramePlan{}); }
void lit_points_16m(benchmark::State& state) {
  draw(state, many_points(), with(kPoints, &FramePlan::lighting));
}
void eye_dome_points_16m(benchmark::State& state) {
  draw(state, many_points(), with(kPoints, &FramePlan::eye_dome));
}
void discs_16m(benchmark::State& state) { draw(state, many_points(), kDiscs); }
void discs_1m(benchmark::State& state) { draw(state, one_million(), kDiscs); }
void splats_16m(benchmark::State& state) { draw(state, many_points(), kSplats); }
void splats_1m(benchmark::State& state) { draw(state, one_million(), kSplats); }
void empty_frame(benchmark::State& state) {
  Frame frame = many_points().frame(kPoints);
  frame.items.clear();
  for (auto _ : state) many_points().renderer().draw(frame);
}

constexpr std::size_t kWords = std::size_t{64} << 20;  ///< half a gigabyte
constexpr std::size_t kGrain = std::size_t{1} << 20;
using Range = tbb::blocked_range<std::size_t>;

void memory_read(benchmark::State& state) {
  const std::vector<std::uint64_t> words(kWords, 1);
  for (auto _ : state) {
    const std::uint64_t sum = tbb::parallel_reduce(
        Range(0, kWords, kGrain), std::uint64_t{0},
        [&](const Range& range, std::uint64_t so_far) {
          return std::accumulate(&words[range.begin()], &words[range.begin()] + range.size(),
                                 so_far);
        },
        std::plus<>());
    benchmark::DoNotOptimize(sum);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(8 * kWords));
}

void memory_copy(benchmark::State& state) {
  const std::vector<std::uint64_t> from(kWords, 1);
  std::vector<std::uint64_t> to(kWords);
  for (auto _ : state) {
    tbb::parallel_for(Range(0, kWords, kGrain), [&](const Range& range) {
      std::copy_n(&from[range.begin()], range.size(), &to[range.begin()]);
    });
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(16 * kWords));
}

#define CAIRN_BENCHMARK(name) BENCHMARK(name)->Unit(benchmark::kMillisecond)->UseRealTime()
CAIRN_BENCHMARK(memory_read);
CAIRN_BENCHMARK(memory_copy);
CAIRN_BENCHMARK(empty_frame);
CAIRN_BENCHMARK(points_16m);
CAIRN_BENCHMARK(points_in_random_order_16m);
CAIRN_BENCHMARK(plain_points_16m);
CAIRN_BENCHMARK(lit_points_16m);
CAIRN_BENCHMARK(eye_dome_points_16m);
CAIRN_BENCHMARK(discs_16m);
CAIRN_BENCHMARK(discs_1m);
CAIRN_BENCHMARK(splats_16m);
CAIRN_BENCHMARK(splats_1m);

}  // namespace
