// Draws frames with OpenGL 4.5 core.
//
// Points, discs and splats are all GL_POINTS: a round one is cut out of its square by the fragment
// shader (shaders.h). Deferred blending is after Zhang and Pajarola, "Deferred blending: Image
// composition for single-pass point rendering", 2007.
#pragma once

#include <memory>

#include "viewer/gl/gl_errors.h"
#include "viewer/gl/gl_object.h"
#include "viewer/gl/item_list.h"
#include "viewer/gl/occlusion.h"
#include "viewer/gl/point_store.h"
#include "viewer/gl/programs.h"
#include "viewer/gl/targets.h"
#include "viewer/gl/view_uniforms.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

/// The edges of a box, over a finished frame.
struct BoxLine {
  glm::vec3 center{0, 0, 0};  ///< from the eye of the last frame
  glm::vec3 half{0, 0, 0};
  std::uint32_t color = 0xffffffff;  ///< as PointColumns::color
};

/// All members are for the thread and context that it was made on, and so is its end.
///
/// Buffers are allocated when it is made, targets when the size of the picture changes or a plan
/// first calls for a pass, nothing else at any time (but names of queries, when a frame first has
/// so many items).
///
/// It draws into framebuffers of its own and sets all state that it needs. It leaves the
/// framebuffers, vertex array and program of the caller unbound, depth test and blending off, the
/// viewport on the picture, and clip control as it is in a new context.
class GlRenderer : public Renderer {
 public:
  /// Requires a current context of OpenGL 4.5 or later (Error of kind kSystem otherwise). Throws
  /// Error: kSystem where the card has no room for the slots, kUsage for more points than it can
  /// number.
  explicit GlRenderer(const RendererSize& size);

  std::uint32_t slots() const override { return store_.size().slots; }
  void upload(std::uint32_t slot, const PointColumns& points) override;
  /// Requires a plan whose columns the renderer has (columns_of), and no plan that blends deferred
  /// with occlusion queries: its layers have no one depth to test against. Throws Error: kSystem
  /// out of memory, kUsage for too large a picture.
  DrawStatistics draw(const Frame& frame) override;
  /// Requires a frame drawn.
  Picture picture() override;

  /// Adds lines to the last frame, hidden by its points. Requires a frame drawn.
  void draw_boxes(std::span<const BoxLine> boxes);
  /// Copies the last frame over a whole framebuffer of this size (0: the window's), which must not be
  /// multisampled. Requires a frame drawn.
  void show(unsigned framebuffer, PictureSize size);
  /// Bytes of the targets that plans have called for so far, at the size of the last picture.
  std::uint64_t target_bytes() const { return targets_.bytes(); }

 private:
  void start(const Frame& frame);
  void finish();
  void draw_points(const Frame& frame);
  void draw_blended(const Frame& frame);
  void draw_groups(const Frame& frame);
  void first_pass(const Frame& frame, const std::string& program);
  void second_pass(const Frame& frame, const std::string& program);
  void shade_edges();
  void screen_pass(std::string_view name);

  gl::ErrorWatch errors_;
  gl::PointStore store_;
  gl::ItemList items_;
  gl::Programs programs_;
  gl::Targets targets_;
  gl::Occlusion occlusion_;
  gl::ViewUniforms uniforms_;
  gl::VertexArray empty_;  ///< of what has no attributes
};

}  // namespace cairn::viewer
