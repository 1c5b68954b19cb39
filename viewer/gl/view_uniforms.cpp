#include "viewer/gl/view_uniforms.h"

#include <algorithm>
#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "viewer/renderer.h"

namespace cairn::viewer::gl {
namespace {

/// As std140 lays it out.
struct FrameBlock {
  glm::vec3 right;
  float focal;
  glm::vec3 up;
  float near;
  glm::vec3 forward;
  float point_pixels;
  glm::vec2 middle, clip_scale;
  float radius_limit;
  std::array<float, 3> unused{};
};
static_assert(sizeof(FrameBlock) == 80);

/// Points are at most as large as the driver draws them, whose squares are a pixel larger.
float largest_radius() {
  std::array<GLfloat, 2> range{};
  glGetFloatv(GL_POINT_SIZE_RANGE, range.data());
  return std::min(shading::kMaxPixelRadius, (range[1] - 1) / 2);
}

float largest_viewport() {
  std::array<GLint, 2> most{};
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, most.data());
  return static_cast<float>(std::min(most[0], most[1]));
}

}  // namespace

ViewUniforms::ViewUniforms()
    : buffer_(make_buffer()), radius_limit_(largest_radius()), most_pixels_(largest_viewport()) {
  glNamedBufferStorage(buffer_.name(), sizeof(FrameBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
}

void ViewUniforms::set(const View& view, float point_pixels) {
  size_ = view.size();
  const glm::vec2 pixels(size_.width, size_.height);
  const float room = most_pixels_ - std::max(pixels.x, pixels.y);
  margin_ = std::clamp(room / 2, 0.0f, radius_limit_ + 1);
  const FrameBlock block{.right = glm::vec3(view.right()),
                         .focal = static_cast<float>(view.focal_pixels()),
                         .up = glm::vec3(view.up()),
                         .near = static_cast<float>(view.near()),
                         .forward = glm::vec3(view.forward()),
                         .point_pixels = point_pixels,
                         .middle = pixels / 2.0f,
                         .clip_scale = 2.0f / (pixels + 2 * margin_),
                         .radius_limit = radius_limit_};
  glNamedBufferSubData(buffer_.name(), 0, sizeof(block), &block);
}

void ViewUniforms::bind() const {
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer_.name());
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  set_viewport(true);
}

void ViewUniforms::unbind() const {
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, 0);
  glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  set_viewport(false);
}

void ViewUniforms::set_viewport(bool with_margin) const {
  const float margin = with_margin ? margin_ : 0;
  glViewportIndexedf(0, -margin, -margin, static_cast<float>(size_.width) + 2 * margin,
                     static_cast<float>(size_.height) + 2 * margin);
}

}  // namespace cairn::viewer::gl
