// Both renderers draw the same picture: of a random scene, for every primitive and effect.
//
// They differ where rounding decides. A driver places points in steps of a part of a pixel (1/256
// with Mesa's software renderer), so that a point that lies closer than that to a pixel's edge may
// be a pixel off; colors and weights are rounded in another order; and what is a disc's or a
// splat's edge pixel for one may lie just outside for the other. Points have random colors here, so
// that each such pixel is far off in color, and neighbors of it as well with eye-dome lighting.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <numbers>
#include <ostream>
#include <random>
#include <string>

#include "tests/support/pictures.h"
#include "tests/viewer/gl_fixture.h"
#include "viewer/cpu/cpu_renderer.h"

namespace cairn::viewer::tests {
namespace {

/// At most this share of pixels may be apart. Measured with Mesa 22.3: 0.0003 and less for points,
/// none for discs, 0.00001 for splats.
constexpr double kShare = 0.001;

constexpr std::uint32_t kSlots = 8;
constexpr std::uint32_t kSlotPoints = 700;
constexpr PictureSize kScenePicture{400, 300};
const glm::vec3 kSphereCenter(0.1f, 5, 0.2f);

std::uint32_t random_color(std::mt19937& random) { return 0xff000000 | (random() & 0xffffff); }

/// On a sphere of radius 1.5.
ScenePoint on_sphere(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  const float z = 2 * unit(random) - 1;
  const float angle = 2 * std::numbers::pi_v<float> * unit(random);
  const float ring = std::sqrt(1 - z * z);
  const glm::vec3 normal(ring * std::cos(angle), ring * std::sin(angle), z);
  return {kSphereCenter + 1.5f * normal, random_color(random), 0.05f + 0.05f * unit(random),
          normal};
}

/// On a floor that passes below the eye; some points have no normal.
ScenePoint on_floor(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(-1, 1);
  const glm::vec3 place(8 * unit(random), 5 + 6 * unit(random), -1);
  const bool normal = random() % 8 != 0;
  return {place, random_color(random), 0.2f, normal ? glm::vec3(0, 0, 1) : glm::vec3(0)};
}

/// Slots of the sphere, then of the floor; each item is two ranges of a slot, with the slot's
/// points from a center of its own.
struct Scene {
  std::vector<NodePoints> slots;
  std::vector<DrawItem> items;

  Scene() {
    std::mt19937 random(7);
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      const glm::vec3 center(0.5f * static_cast<float>(slot), 4, -1);
      std::vector<ScenePoint> points;
      for (std::uint32_t i = 0; i < kSlotPoints; ++i) {
        points.push_back(slot < kSlots / 2 ? on_sphere(random) : on_floor(random));
        points.back().position -= center;
      }
      slots.push_back(points_of(points));
      for (const std::uint32_t first : {0u, kSlotPoints / 3})
        items.push_back({.slot = slot,
                         .first = first,
                         .count = first == 0 ? kSlotPoints / 3 : kSlotPoints - first,
                         .offset = center,
                         .tint = random_color(random)});
    }
  }
};

Picture picture_of(Renderer& renderer, const Scene& scene, const FramePlan& plan) {
  for (std::uint32_t slot = 0; slot < kSlots; ++slot)
    renderer.upload(slot, scene.slots[slot].columns());
  renderer.draw({view_along_y(kScenePicture), plan, scene.items});
  return renderer.picture();
}

struct Case {
  std::string name;
  FramePlan plan;
};
void PrintTo(const Case& scene, std::ostream* out) { *out << scene.name; }

/// Every primitive with and without each effect, and sizes of points.
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Primitive primitive : {Primitive::kPoints, Primitive::kDiscs, Primitive::kSplats})
    for (int effects = 0; effects < 16; ++effects) {
      FramePlan plan{.primitive = primitive};
      std::string name(name_of(primitive));
      const auto effect = [&](int bit, bool& flag, const char* word) {
        flag = (effects >> bit & 1) != 0;
        if (flag) name += word;
      };
      bool tint = false;
      effect(0, plan.lighting, "Lit");
      effect(1, plan.eye_dome, "EyeDome");
      effect(2, plan.cull_back_faces, "Culled");
      effect(3, tint, "Tinted");
      plan.color = tint ? ColorSource::kLevel : ColorSource::kColor;
      plan.oriented = primitive == Primitive::kSplats && effects != 8;
      plan.point_pixels = effects % 2 == 0 ? 1 : 4;
      all.push_back({name, plan});
    }
  return all;
}

class SamePicture : public GlTest, public testing::WithParamInterface<Case> {};

TEST_P(SamePicture, OnTheProcessorAndWithOpenGl) {
  const Scene scene;
  const RendererSize size{kAllColumns, kSlots, kSlotPoints};
  CpuRenderer cpu(size);
  GlRenderer gl(size);
  const Picture expected = picture_of(cpu, scene, GetParam().plan);
  const Picture drawn = picture_of(gl, scene, GetParam().plan);
  ASSERT_EQ(drawn.size, expected.size);
  EXPECT_GT(covered_pixels(expected), 2000u);
  const double share = test::share_of_pixels_apart(drawn, expected);
  RecordProperty("share", std::to_string(share));
  EXPECT_LE(share, kShare);
}

INSTANTIATE_TEST_SUITE_P(All, SamePicture, testing::ValuesIn(cases()),
                         [](const auto& scene) { return scene.param.name; });

}  // namespace
}  // namespace cairn::viewer::tests
