#include "viewer/gl/targets.h"

#include <fmt/format.h>

#include "formats/error.h"

namespace cairn::viewer::gl {
namespace {

void attach(const Framebuffer& framebuffer, GLenum attachment, const Texture& texture) {
  glNamedFramebufferTexture(framebuffer.name(), attachment, texture.name(), 0);
}

GLsizei signed_size(std::uint32_t size) { return static_cast<GLsizei>(size); }

void check_size(PictureSize size) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  CAIRN_CHECK(size.width > 0 && size.height > 0);
  if (size.width > static_cast<std::uint32_t>(most) ||
      size.height > static_cast<std::uint32_t>(most))
    formats::throw_usage(
        fmt::format("a picture of {} x {} pixels is larger than the {} that OpenGL draws here; "
                    "--mode cpu can",
                    size.width, size.height, most));
}

}  // namespace

void Targets::prepare(PictureSize size, const FramePlan& plan) {
  if (size != size_) {
    check_size(size);
    clear();
    size_ = size;
    make_base();
  }
  if (plan.primitive != Primitive::kSplats) return;
  if (plan.deferred_blending && !group_colors_) make_groups();
  if (!plan.deferred_blending && !sums_texture_) make_sums();
}

Texture Targets::texture(GLenum format, std::uint32_t pixel_bytes) {
  Texture texture = make_texture(GL_TEXTURE_2D);
  glTextureStorage2D(texture.name(), 1, format, signed_size(size_.width),
                     signed_size(size_.height));
  bytes_ += std::uint64_t{size_.width} * size_.height * pixel_bytes;
  return texture;
}

Texture Targets::layers(GLenum format, std::uint32_t pixel_bytes) {
  Texture texture = make_texture(GL_TEXTURE_2D_ARRAY);
  glTextureStorage3D(texture.name(), 1, format, signed_size(size_.width), signed_size(size_.height),
                     signed_size(PointStore::kGroups));
  bytes_ += std::uint64_t{size_.width} * size_.height * pixel_bytes * PointStore::kGroups;
  return texture;
}

void Targets::make_base() {
  color_texture_ = texture(GL_RGBA8, 4);
  depth_texture_ = texture(GL_DEPTH_COMPONENT32F, 4);
  color_and_depth_ = make_framebuffer();
  attach(color_and_depth_, GL_COLOR_ATTACHMENT0, color_texture_);
  attach(color_and_depth_, GL_DEPTH_ATTACHMENT, depth_texture_);
  color_only_ = make_framebuffer();
  attach(color_only_, GL_COLOR_ATTACHMENT0, color_texture_);
}

void Targets::make_sums() {
  depth_only_ = make_framebuffer();
  attach(depth_only_, GL_DEPTH_ATTACHMENT, depth_texture_);
  glNamedFramebufferDrawBuffer(depth_only_.name(), GL_NONE);
  sums_texture_ = texture(GL_RGBA32F, 16);
  sums_ = make_framebuffer();
  attach(sums_, GL_COLOR_ATTACHMENT0, sums_texture_);
  attach(sums_, GL_DEPTH_ATTACHMENT, depth_texture_);
}

void Targets::make_groups() {
  group_colors_ = layers(GL_RGBA8, 4);
  group_radii_ = layers(GL_R32F, 4);
  group_depths_ = layers(GL_DEPTH_COMPONENT32F, 4);
  for (std::uint32_t group = 0; group < PointStore::kGroups; ++group) {
    groups_[group] = make_framebuffer();
    const GLuint name = groups_[group].name();
    const GLint layer = signed_size(group);
    glNamedFramebufferTextureLayer(name, GL_COLOR_ATTACHMENT0, group_colors_.name(), 0, layer);
    glNamedFramebufferTextureLayer(name, GL_COLOR_ATTACHMENT1, group_radii_.name(), 0, layer);
    glNamedFramebufferTextureLayer(name, GL_DEPTH_ATTACHMENT, group_depths_.name(), 0, layer);
    constexpr GLenum kBoth[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glNamedFramebufferDrawBuffers(name, 2, kBoth);
  }
}

}  // namespace cairn::viewer::gl
