// How a frame's view reaches the shaders.
//
// OpenGL clips a point by its center, and a large one whose center lies beside the picture would be
// missing at the picture's edge. So the viewport reaches beyond the target by the largest radius on
// each side, and the edge of the target alone cuts.
#pragma once

#include "viewer/camera.h"
#include "viewer/gl/gl_object.h"

namespace cairn::viewer::gl {

/// The uniform block Frame of shaders.h, and the viewport that belongs to it.
class ViewUniforms {
 public:
  ViewUniforms();

  /// Takes a frame's view. `point_pixels`: the side of a point.
  void set(const View& view, float point_pixels);
  /// Shaders read it, clip space and the viewport are as they need them.
  void bind() const;
  /// Clip space is as in a new context, and the viewport is the picture.
  void unbind() const;
  /// The viewport is the picture, with or without the margin that points need.
  void set_viewport(bool with_margin) const;

 private:
  Buffer buffer_;
  float radius_limit_;  ///< of a disc, pixels
  float most_pixels_;   ///< of a side of the viewport
  PictureSize size_{0, 0};
  float margin_ = 0;  ///< on each side of the picture, pixels
};

}  // namespace cairn::viewer::gl
