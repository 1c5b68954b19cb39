// What frames are drawn into. Every frame has a color and a depth; what else a pass needs is
// allocated when a plan first calls for it, and all anew where the size of the picture changes.
#pragma once

#include <array>
#include <cstdint>

#include "viewer/frame_plan.h"
#include "viewer/gl/gl_object.h"
#include "viewer/gl/point_store.h"

namespace cairn::viewer::gl {

class Targets {
 public:
  /// Throws Error (kUsage) for a picture larger than the driver draws. Whether there was room,
  /// glGetError tells; call clear() if there was none.
  void prepare(PictureSize size, const FramePlan& plan);
  void clear() { *this = Targets(); }

  PictureSize size() const { return size_; }
  /// Bytes of all targets that are allocated.
  std::uint64_t bytes() const { return bytes_; }

  // Framebuffers. Color is RGBA8, depth 32-bit float.
  GLuint color_and_depth() const { return color_and_depth_.name(); }
  GLuint color() const { return color_only_.name(); }
  GLuint depth() const { return depth_only_.name(); }
  /// Sums of weighted colors and of weights, with the same depth. 32-bit floats, since the sum of
  /// many splats must not lose the small ones: a 16-bit float of 2048 takes no more steps below 2.
  GLuint sums() const { return sums_.name(); }
  /// One layer of a group: color and weight (RGBA8), radius, and a depth of its own.
  GLuint group(std::uint32_t group) const { return groups_[group].name(); }

  // Textures.
  GLuint color_texture() const { return color_texture_.name(); }
  GLuint depth_texture() const { return depth_texture_.name(); }
  GLuint sums_texture() const { return sums_texture_.name(); }
  std::array<GLuint, 3> group_textures() const {
    return {group_colors_.name(), group_radii_.name(), group_depths_.name()};
  }

 private:
  void make_base();
  void make_sums();
  void make_groups();
  Texture texture(GLenum format, std::uint32_t pixel_bytes);
  Texture layers(GLenum format, std::uint32_t pixel_bytes);

  PictureSize size_{0, 0};
  std::uint64_t bytes_ = 0;
  Texture color_texture_, depth_texture_, sums_texture_;
  Texture group_colors_, group_radii_, group_depths_;
  Framebuffer color_and_depth_, color_only_, depth_only_, sums_;
  std::array<Framebuffer, PointStore::kGroups> groups_;
};

}  // namespace cairn::viewer::gl
