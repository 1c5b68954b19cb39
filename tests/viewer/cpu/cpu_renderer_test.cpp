#include "viewer/cpu/cpu_renderer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "formats/error.h"
#include "tests/support/sanitizers.h"
#include "tests/viewer/cpu/drawn_points.h"

namespace cairn::viewer {
namespace {

/// Random points in several slots, many in front of others.
class CpuRendererOrder : public testing::TestWithParam<FramePlan> {
 protected:
  CpuRendererOrder() {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      std::vector<Point> points;
      for (int i = 0; i < 5000; ++i)
        points.push_back(
            {.position = {unit(random), unit(random), unit(random)},
             .rgb = {static_cast<int>(random() % 256), static_cast<int>(random() % 256),
                     static_cast<int>(random() % 256)},
             .radius = 0.05f + 0.05f * unit(random),
             .normal = {unit(random), unit(random), unit(random)}});
      renderer_.upload(slot, node_of(points).columns());
      items_.push_back({.slot = slot, .count = 5000, .offset = {3 + 0.1f * slot, 0, 0}});
    }
  }

  Picture drawn_by(int threads) {
    const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] { renderer_.draw({.view = view(), .plan = GetParam(), .items = items_}); });
    return renderer_.picture();
  }

  static constexpr std::uint32_t kSlots = 12;
  CpuRenderer renderer_{{.columns = kAll, .slots = kSlots, .slot_points = 5000}};
  std::vector<DrawItem> items_;
};

TEST_P(CpuRendererOrder, NeitherThreadsNorTheOrderOfItemsChangeThePicture) {
  const Picture first = drawn_by(1);
  std::mt19937 random(3);
  for (const int threads : {1, 2, 7}) {
    EXPECT_TRUE(drawn_by(threads) == first) << threads << " threads";
    std::shuffle(items_.begin(), items_.end(), random);
    EXPECT_TRUE(drawn_by(threads) == first) << threads << " threads, shuffled";
  }
  // Cut into pieces, points stand elsewhere in their batches.
  std::vector<DrawItem> pieces;
  for (const DrawItem& item : items_)
    for (const auto& [begin, end] : {std::pair{0u, 1u}, {1u, 778u}, {778u, 5000u}}) {
      pieces.push_back(item);
      pieces.back().first = begin;
      pieces.back().count = end - begin;
    }
  items_ = pieces;
  EXPECT_TRUE(drawn_by(2) == first) << "in pieces";
}

FramePlan with_all_effects(FramePlan plan) {
  plan.lighting = plan.cull_back_faces = plan.eye_dome = true;
  return plan;
}
FramePlan wide_points() {
  FramePlan plan = kPoints;
  plan.point_pixels = 3;
  return plan;
}

INSTANTIATE_TEST_SUITE_P(Plans, CpuRendererOrder,
                         testing::Values(kPoints, wide_points(), kDiscs, kSplats,
                                         with_all_effects(kPoints), with_all_effects(kDiscs),
                                         with_all_effects(kSplats)));

TEST(CpuRenderer, PlacesAnItemByItsOffsetAndRange) {
  CpuRenderer renderer({.columns = {}, .slots = 3, .slot_points = 4});
  const std::vector<glm::vec3> positions(4, seen_at(10.5, 9.5, 2));
  renderer.upload(2, {.position = positions, .radius = {}, .color = {}, .normal = {}});
  const glm::vec3 offset = seen_at(40.5, 30.5, 2) - seen_at(10.5, 9.5, 2);
  FramePlan plan;
  plan.color = ColorSource::kLevel;
  const DrawStatistics statistics = renderer.draw(
      {.view = view(),
       .plan = plan,
       .items = {{.slot = 2, .first = 1, .count = 2, .offset = offset, .tint = 0x00030201}}});
  EXPECT_EQ(statistics.points, 2u);
  EXPECT_EQ(at(renderer.picture(), 40, 30), (Rgb{1, 2, 3}));
  expect_covered(renderer.picture(), [](int x, int y) { return x == 40 && y == 30; });
}

TEST(CpuRenderer, AllocatesSumsOnlyOnceSplatsAreDrawn) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2)}}).columns());
  EXPECT_EQ(renderer.buffer_bytes(), 0u);
  constexpr std::size_t kPixels = std::size_t{kSize.width} * kSize.height;
  for (FramePlan plan : {kPoints, kDiscs, with_all_effects(kDiscs)}) {
    renderer.draw({.view = view(), .plan = plan, .items = {{.slot = 0, .count = 1}}});
    EXPECT_EQ(renderer.buffer_bytes(), (8 + 3) * kPixels) << "a word and a color a pixel";
  }
  renderer.draw({.view = view(), .plan = kSplats, .items = {{.slot = 0, .count = 1}}});
  EXPECT_EQ(renderer.buffer_bytes(), (8 + 3 + 32) * kPixels);
}

TEST(CpuRenderer, BeginsEachFrameAnewInAnySize) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  EXPECT_EQ(renderer.picture(), Picture{});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2), .radius = 0.5f}}).columns());
  for (const FramePlan& plan : {kSplats, kPoints, kSplats})
    for (const PictureSize size : {PictureSize{80, 48}, kSize, PictureSize{16, 8}}) {
      renderer.draw({.view = view(size), .plan = plan, .items = {{.slot = 0, .count = 1}}});
      renderer.draw({.view = view(size), .plan = plan, .items = {}});
      EXPECT_EQ(renderer.picture().size, size);
      expect_covered(renderer.picture(), [](int, int) { return false; });
    }
}

TEST(CpuRenderer, DrawsProbesAsOtherItems) {
  CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 1});
  renderer.upload(0, node_of({{.position = seen_at(20.5, 20.5, 2)}}).columns());
  FramePlan plan = kPoints;
  plan.occlusion_queries = true;
  const DrawStatistics statistics = renderer.draw(
      {.view = view(), .plan = plan, .items = {{.slot = 0, .count = 1, .probe = true}}});
  EXPECT_EQ(statistics.points, 1u);
  EXPECT_TRUE(statistics.seen.empty());
  EXPECT_EQ(at(renderer.picture(), 20, 20), (Rgb{255, 255, 255}));
}

TEST(CpuRenderer, RefusesItemsAndPlansThatItHasNotThePointsFor) {
  CpuRenderer renderer({.columns = {.radius = true}, .slots = 2, .slot_points = 4});
  const std::vector<glm::vec3> positions(3);
  const std::vector<float> radii(3);
  renderer.upload(1, {.position = positions, .radius = radii, .color = {}, .normal = {}});
  FramePlan plain;
  for (const DrawItem& item :
       {DrawItem{.slot = 2, .count = 1}, DrawItem{.slot = 0, .count = 1},
        DrawItem{.slot = 1, .first = 2, .count = 2}, DrawItem{.slot = 1, .first = 4, .count = 0}})
    EXPECT_THROW(renderer.draw({.view = view(), .plan = plain, .items = {item}}), formats::Error);
  EXPECT_THROW(renderer.draw({.view = view(), .plan = kPoints, .items = {}}), formats::Error);
  EXPECT_THROW(renderer.upload(2, {}), formats::Error);
  EXPECT_THROW(renderer.upload(0, {.position = positions, .radius = {}, .color = {}, .normal = {}}),
               formats::Error);
}

/// Pages of this process that are in memory, in bytes.
std::size_t resident_bytes() {
  std::ifstream status("/proc/self/statm");
  std::size_t all = 0;
  std::size_t resident = 0;
  status >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

TEST(CpuRenderer, TakesNoMemoryForSlotsThatAreEmpty) {
  const std::size_t before = resident_bytes();
  ASSERT_GT(before, 0u);
  const CpuRenderer renderer({.columns = kAll, .slots = 1024, .slot_points = 65536});
  EXPECT_LT(resident_bytes(), before + (std::size_t{64} << 20)) << "of 1.6 GB of columns";
}

TEST(CpuRenderer, SaysHowManyPointsTheMachineHasNoRoomFor) {
#ifdef CAIRN_UNDER_SANITIZER
  GTEST_SKIP() << "the sanitizer's allocator ends the program";
#endif
  try {
    const CpuRenderer renderer({.columns = kAll, .slots = 1u << 20, .slot_points = 1u << 31});
    FAIL() << "there are 54 petabytes";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("1048576 nodes of 2147483648 points"),
              std::string::npos);
  }
}

/// Even a point that has the background's color is no hole.
TEST(CpuRenderer, TellsWhichPixelsItCovered) {
  for (const FramePlan& plan : {kPoints, kDiscs, kSplats}) {
    CpuRenderer renderer({.columns = kAll, .slots = 1, .slot_points = 2});
    const std::vector<Point> points{{.position = seen_at(10.5, 5.5, 2), .rgb = kBackground},
                                    {.position = seen_at(40.5, 7.5, 2)}};
    renderer.upload(0, node_of(points).columns());
    renderer.draw({.view = view(), .plan = plan, .items = {{.slot = 0, .count = 2}}});
    std::vector<std::uint8_t> expected(std::size_t{kSize.width} * kSize.height, 0);
    expected[5 * kSize.width + 10] = expected[7 * kSize.width + 40] = 1;
    EXPECT_EQ(renderer.covered(), expected) << name_of(plan.primitive);
  }
}

}  // namespace
}  // namespace cairn::viewer
