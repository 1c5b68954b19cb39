// What draws a frame: equal slots for the points of nodes, and ranges of them to draw. Two renderers implement it, on
// OpenGL and on the processor; both draw the same picture within the tolerance that tests/viewer/same_picture_test.cpp
// states.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "viewer/camera.h"
#include "viewer/frame_plan.h"
#include "viewer/picture.h"
#include "viewer/point_columns.h"

namespace cairn::viewer {

/// A range of a slot's points.
struct DrawItem {
  std::uint32_t slot = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  glm::vec3 offset{0, 0, 0};  ///< from the eye to the center of the node's box
  std::uint32_t tint =
      0;  ///< the color of all points if the plan's color is kPlain, kLevel, kError; as PointColumns::color
  std::uint32_t region =
      0;               ///< the node whose region it stands for; the first, if it joins several
  bool probe = false;  ///< hidden a frame ago: to be drawn only where its region's box is seen
  glm::vec3 box_center{
      0, 0, 0};  ///< of the region, from the eye; only if the plan asks occlusion queries
  glm::vec3 box_half{0, 0, 0};
};

struct Frame {
  View view;
  FramePlan plan;
  std::vector<DrawItem> items;  ///< near to far
};

/// Whether a region was seen in the last frame.
struct RegionSeen {
  std::uint32_t region = 0;
  bool seen = true;
};

/// What a renderer tells of the frame that it drew.
struct DrawStatistics {
  std::uint64_t points = 0;         ///< sent to be drawn, probes that failed left out
  std::uint64_t unseen_points = 0;  ///< of probes that failed
  std::vector<RegionSeen> seen;     ///< one an item, only if the plan asks occlusion queries
};

class Renderer {
 public:
  virtual ~Renderer() = default;

  /// Nodes that it has room for, and points of one: fixed from the start.
  virtual std::uint32_t slots() const = 0;
  /// Puts a node's points into a slot, in place of what was there. Columns are those of the renderer's ColumnSet.
  virtual void upload(std::uint32_t slot, const PointColumns& points) = 0;
  virtual DrawStatistics draw(const Frame& frame) = 0;
  /// The last frame drawn.
  virtual Picture picture() = 0;
};

/// What a renderer is made for.
struct RendererSize {
  ColumnSet columns;
  std::uint32_t slots = 1;
  std::uint32_t slot_points = 1;
};

/// What both renderers shade by.
namespace shading {
inline constexpr std::uint8_t kBackground[3] = {24, 26, 30};
/// Light at the eye: color * (kAmbient + (1 - kAmbient) |n . v|), v from the point to the eye.
inline constexpr float kAmbient = 0.25f;
/// Eye-dome lighting (Boucheny 2009): with z the depth, response r = mean over 8 neighbours at kEyeDomePixels of
/// max(0, log2 z - log2 z_neighbour), the background counting 0; the color is multiplied by exp(-kEyeDomeStrength r).
inline constexpr float kEyeDomeStrength = 30.0f;
inline constexpr int kEyeDomePixels = 2;
/// Splats lie on one surface where their depths differ by less than this many of the nearer one's radii.
inline constexpr float kBlendRadii = 1.0f;
/// Weight of a splat at distance t of its radius: (1 - t^2)^2.
/// A disc or splat is at least this many pixels in radius, so that none falls between pixels.
inline constexpr float kMinPixelRadius = 0.70710678f;
inline constexpr float kMaxPixelRadius = 127.0f;
}  // namespace shading

}  // namespace cairn::viewer
