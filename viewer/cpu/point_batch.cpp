#include "viewer/cpu/point_batch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "formats/error.h"
#include "viewer/cpu/nearest_buffer.h"
#include "viewer/cpu/rounding.h"

namespace cairn::viewer {
namespace {

/// All bits or none: a choice by `?:` or `&&` would become a branch.
std::uint32_t mask_of(bool condition) { return 0u - condition; }

float masked(float value, std::uint32_t mask) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) & mask);
}

float chosen(bool condition, float yes, float no) {
  const std::uint32_t mask = mask_of(condition);
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(yes) & mask) |
                              (std::bit_cast<std::uint32_t>(no) & ~mask));
}

/// Where points appear, and how deep; the depth of those outside is 0.
void project(PointBatch& batch, const BatchRules& rules, const SlotColumns& columns,
             const glm::vec3& offset) {
  const Lens lens = rules.lens;
  const float least = -rules.margin;
  const float right_end = static_cast<float>(lens.width) + rules.margin;
  const float lower_end = static_cast<float>(lens.height) + rules.margin;
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    const float x = offset.x + columns.x[i];
    const float y = offset.y + columns.y[i];
    const float z = offset.z + columns.z[i];
    const float across = lens.right.x * x + lens.right.y * y + lens.right.z * z;
    const float along = lens.up.x * x + lens.up.y * y + lens.up.z * z;
    const float depth = lens.forward.x * x + lens.forward.y * y + lens.forward.z * z;
    const float scale = lens.focal / depth;
    const float picture_x = lens.center_x + across * scale;
    const float picture_y = lens.center_y - along * scale;
    // Nothing for what is not a number.
    const std::uint32_t inside = mask_of(depth >= lens.near) & mask_of(picture_x >= least) &
                                 mask_of(picture_x < right_end) & mask_of(picture_y >= least) &
                                 mask_of(picture_y < lower_end);
    batch.x[i] = masked(picture_x, inside);
    batch.y[i] = masked(picture_y, inside);
    batch.depth[i] = masked(depth, inside);
    batch.across[i] = across;
    batch.along[i] = along;
  }
}

/// One of the three numbers of pack_normal, of any length.
float unpacked(std::uint32_t bits, int shift) {
  return static_cast<float>(static_cast<std::int32_t>(bits << (22 - shift)) >> 22);
}

/// Light by the normals, and back faces left out.
void shade(PointBatch& batch, const BatchRules& rules, const SlotColumns& columns,
           const glm::vec3& offset) {
  const std::uint32_t cull = mask_of(rules.cull_back_faces);
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    const float x = offset.x + columns.x[i];
    const float y = offset.y + columns.y[i];
    const float z = offset.z + columns.z[i];
    const float nx = unpacked(columns.normal[i], 0);
    const float ny = unpacked(columns.normal[i], 10);
    const float nz = unpacked(columns.normal[i], 20);
    const float facing = nx * x + ny * y + nz * z;
    const float squares = (nx * nx + ny * ny + nz * nz) * (x * x + y * y + z * z);
    const float cosine = std::abs(facing) / std::sqrt(squares);
    // Without a normal the cosine is not a number: then all of the light falls in.
    batch.light[i] = shading::kAmbient + (1 - shading::kAmbient) * chosen(cosine < 1, cosine, 1);
    batch.depth[i] = masked(batch.depth[i], ~(cull & mask_of(facing > 0)));
  }
}

void turn_normals(PointBatch& batch, const Lens& lens, const std::uint32_t* normal) {
  const glm::vec3 right = lens.right;
  const glm::vec3 up = lens.up;
  const glm::vec3 forward = lens.forward;
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    const float x = unpacked(normal[i], 0);
    const float y = unpacked(normal[i], 10);
    const float z = unpacked(normal[i], 20);
    // Whole numbers: a length below 1 is 0.
    const float length = std::sqrt(x * x + y * y + z * z);
    const float scale = 1 / chosen(length > 1, length, 1);
    batch.normal_x[i] = (right.x * x + right.y * y + right.z * z) * scale;
    batch.normal_y[i] = (up.x * x + up.y * y + up.z * z) * scale;
    batch.normal_z[i] = (forward.x * x + forward.y * y + forward.z * z) * scale;
  }
}

std::uint32_t lit(std::uint32_t color, int shift, float light) {
  const auto byte = static_cast<float>(static_cast<std::int32_t>(color >> shift & 0xff));
  return rounded(byte * light) << shift;
}

}  // namespace

BatchRules batch_rules(const Frame& frame) {
  const FramePlan& plan = frame.plan;
  BatchRules rules{.lens = lens_of(frame.view)};
  if (plan.primitive != Primitive::kPoints)
    rules.margin = shading::kMaxPixelRadius + 1;
  else if (plan.point_pixels > 1)
    rules.margin = plan.point_pixels / 2 + 1;
  rules.tinted = !columns_of(plan).color;
  rules.lighting = plan.lighting;
  rules.cull_back_faces = plan.cull_back_faces;
  rules.oriented = plan.oriented;
  return rules;
}

void PointBatch::fill(const BatchRules& rules, const SlotColumns& columns, std::uint32_t points,
                      const glm::vec3& offset, std::uint32_t tint) {
  CAIRN_CHECK(points <= kSize);
  count = points;
  project(*this, rules, columns, offset);
  if (rules.lighting || rules.cull_back_faces) shade(*this, rules, columns, offset);
  if (rules.oriented) turn_normals(*this, rules.lens, columns.normal);
  if (!rules.colors) return;
  if (rules.tinted)
    std::fill_n(color.begin(), count, tint & kRgbMask);
  else
    for (std::uint32_t i = 0; i < count; ++i) color[i] = columns.color[i] & kRgbMask;
  if (rules.lighting)
    for (std::uint32_t i = 0; i < count; ++i)
      color[i] =
          lit(color[i], 0, light[i]) | lit(color[i], 8, light[i]) | lit(color[i], 16, light[i]);
}

}  // namespace cairn::viewer
