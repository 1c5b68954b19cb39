#include "viewer/gl/gl_renderer.h"

#include <algorithm>
#include <array>

#include "formats/error.h"
#include "viewer/gl/headless_context.h"
#include "viewer/gl/shaders.h"

namespace cairn::viewer {
namespace {

constexpr GLsizei kBoxLineVertices = 24;
constexpr std::array<GLfloat, 4> kNone = {0, 0, 0, 0};
constexpr GLfloat kFarthest = 0;

/// Items that are drawn at once: most frames' items, and no more than a part of a megabyte.
std::uint32_t item_capacity(const RendererSize& size) {
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(std::uint64_t{size.slots} * 8, 256, 16384));
}

const RendererSize& checked(const RendererSize& size) {
  require_gl_45();
  return size;
}

/// The names that the points of a plan are compiled with.
std::string program_of(const FramePlan& plan, const char* primitive) {
  const ColumnSet columns = columns_of(plan);
  std::string names = primitive;
  if (columns.color) names += " COLUMN_COLOR";
  if (columns.normal) names += " NORMALS";
  if (plan.lighting) names += " LIGHTING";
  if (plan.cull_back_faces) names += " CULLING";
  if (plan.oriented && plan.primitive == Primitive::kSplats) names += " ORIENTED";
  return names;
}

DrawStatistics all_drawn(std::span<const DrawItem> items) {
  DrawStatistics statistics;
  for (const DrawItem& item : items) statistics.points += item.count;
  return statistics;
}

std::array<GLfloat, 4> background() {
  std::array<GLfloat, 4> color{0, 0, 0, 1};
  for (std::size_t i = 0; i < 3; ++i) color[i] = static_cast<float>(shading::kBackground[i]) / 255;
  return color;
}

void test_depth(GLenum comparison, bool write) {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(comparison);
  glDepthMask(write ? GL_TRUE : GL_FALSE);
}

void blend(GLenum source, GLenum target) {
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(source, target);
}

}  // namespace

GlRenderer::GlRenderer(const RendererSize& size)
    : store_(checked(size)), items_(item_capacity(size)), empty_(gl::make_vertex_array()) {
  errors_.check("allocating the slots of points");
}

void GlRenderer::upload(std::uint32_t slot, const PointColumns& points) {
  store_.upload(slot, points);
  errors_.check("taking a node's points");
}

DrawStatistics GlRenderer::draw(const Frame& frame) {
  CAIRN_CHECK(store_.size().columns.holds(columns_of(frame.plan)));
  CAIRN_CHECK(!(frame.plan.deferred_blending && frame.plan.occlusion_queries));
  items_.set(store_, frame.items);
  start(frame);
  if (frame.plan.primitive != Primitive::kSplats)
    draw_points(frame);
  else if (frame.plan.deferred_blending)
    draw_groups(frame);
  else
    draw_blended(frame);
  if (frame.plan.eye_dome) shade_edges();
  finish();
  DrawStatistics statistics =
      frame.plan.occlusion_queries ? occlusion_.results(frame.items) : all_drawn(frame.items);
  errors_.check("drawing a frame");
  return statistics;
}

void GlRenderer::start(const Frame& frame) {
  targets_.prepare(frame.view.size(), frame.plan);
  try {
    errors_.check("allocating what a frame is drawn into");
  } catch (...) {
    targets_.clear();
    throw;
  }
  uniforms_.set(frame.view, frame.plan.point_pixels);

  uniforms_.bind();
  glEnable(GL_PROGRAM_POINT_SIZE);
  for (const GLenum off : {GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_DEPTH_CLAMP,
                           GL_FRAMEBUFFER_SRGB})
    glDisable(off);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glClearNamedFramebufferfv(targets_.color_and_depth(), GL_COLOR, 0, background().data());
  glClearNamedFramebufferfv(targets_.color_and_depth(), GL_DEPTH, 0, &kFarthest);
}

void GlRenderer::finish() {
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  uniforms_.unbind();
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
  glBindVertexArray(0);
  glUseProgram(0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void GlRenderer::draw_points(const Frame& frame) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets_.color_and_depth());
  test_depth(GL_GREATER, true);
  const bool discs = frame.plan.primitive == Primitive::kDiscs;
  first_pass(frame, program_of(frame.plan, discs ? "DISCS" : "POINTS"));
}

void GlRenderer::draw_blended(const Frame& frame) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets_.depth());
  test_depth(GL_GREATER, true);
  first_pass(frame, program_of(frame.plan, "SPLATS VISIBILITY"));

  glBindFramebuffer(GL_FRAMEBUFFER, targets_.sums());
  glClearNamedFramebufferfv(targets_.sums(), GL_COLOR, 0, kNone.data());
  test_depth(GL_GEQUAL, false);
  blend(GL_ONE, GL_ONE);
  second_pass(frame, program_of(frame.plan, "SPLATS BLEND"));
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);

  glBindFramebuffer(GL_FRAMEBUFFER, targets_.color());
  glBindTextureUnit(0, targets_.sums_texture());
  screen_pass("NORMALIZE");
}

void GlRenderer::draw_groups(const Frame& frame) {
  test_depth(GL_GREATER, true);
  programs_.use(gl::shader::kPoints, program_of(frame.plan, "SPLATS GROUP"));
  for (std::uint32_t group = 0; group < gl::PointStore::kGroups; ++group) {
    const GLuint target = targets_.group(group);
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    glClearNamedFramebufferfv(target, GL_DEPTH, 0, &kFarthest);
    items_.draw_group(store_, group);
  }

  glBindFramebuffer(GL_FRAMEBUFFER, targets_.color_and_depth());
  test_depth(GL_ALWAYS, true);
  const auto textures = targets_.group_textures();
  glBindTextures(0, static_cast<GLsizei>(textures.size()), textures.data());
  screen_pass("BLEND_GROUPS");
}

void GlRenderer::first_pass(const Frame& frame, const std::string& program) {
  const std::size_t count = frame.items.size();
  programs_.use(gl::shader::kPoints, program);
  if (!frame.plan.occlusion_queries) {
    items_.draw(store_, 0, count);
    return;
  }
  const auto watched = [&](std::size_t i) {
    occlusion_.watch(i, [&] { items_.draw(store_, i, 1); });
  };
  occlusion_.start(count);
  for (std::size_t i = 0; i < count; ++i)
    if (!frame.items[i].probe) watched(i);
  occlusion_.test_boxes(frame.items, frame.view, programs_, empty_.name());
  programs_.use(gl::shader::kPoints, program);
  for (std::size_t i = 0; i < count; ++i)
    if (frame.items[i].probe) occlusion_.draw_if_seen(i, [&] { watched(i); });
}

void GlRenderer::second_pass(const Frame& frame, const std::string& program) {
  programs_.use(gl::shader::kPoints, program);
  const std::size_t count = frame.items.size();
  for (std::size_t i = 0, end = 0; i < count; i = end) {
    const bool conditional = frame.plan.occlusion_queries && frame.items[i].probe;
    for (end = i + 1; !conditional && end < count; ++end)
      if (frame.plan.occlusion_queries && frame.items[end].probe) break;
    if (conditional)
      occlusion_.draw_if_seen(i, [&] { items_.draw(store_, i, 1); });
    else
      items_.draw(store_, i, end - i);
  }
}

void GlRenderer::shade_edges() {
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, targets_.color());
  glBindTextureUnit(0, targets_.depth_texture());
  blend(GL_ZERO, GL_SRC_COLOR);
  screen_pass("EYE_DOME");
}

void GlRenderer::screen_pass(std::string_view name) {
  uniforms_.set_viewport(false);
  glBindVertexArray(empty_.name());
  programs_.use(gl::shader::kScreen, name);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Picture GlRenderer::picture() {
  Picture picture{targets_.size(), {}};
  CAIRN_CHECK(picture.size.width > 0);
  picture.rgb.resize(std::size_t{3} * picture.size.width * picture.size.height);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, targets_.color());
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, static_cast<GLsizei>(picture.size.width),
               static_cast<GLsizei>(picture.size.height), GL_RGB, GL_UNSIGNED_BYTE,
               picture.rgb.data());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  errors_.check("reading a picture");
  return picture;
}

void GlRenderer::draw_boxes(std::span<const BoxLine> boxes) {
  CAIRN_CHECK(targets_.size().width > 0);
  uniforms_.bind();
  glBindFramebuffer(GL_FRAMEBUFFER, targets_.color_and_depth());
  test_depth(GL_GEQUAL, false);
  glBindVertexArray(empty_.name());
  programs_.use(gl::shader::kBox, "LINES");
  for (const BoxLine& box : boxes) {
    const auto channel = [&](int shift) {
      return static_cast<float>(box.color >> shift & 0xff) / 255;
    };
    glUniform3fv(0, 1, &box.center.x);
    glUniform3fv(1, 1, &box.half.x);
    glUniform3f(2, channel(0), channel(8), channel(16));
    glDrawArrays(GL_LINES, 0, kBoxLineVertices);
  }
  finish();
  errors_.check("drawing boxes");
}

void GlRenderer::show(unsigned framebuffer, PictureSize size) {
  const PictureSize from = targets_.size();
  CAIRN_CHECK(from.width > 0);
  const auto width = static_cast<GLint>(size.width);
  const auto height = static_cast<GLint>(size.height);
  const bool same = from == size;
  // Rows run from the top here and from the bottom in a window.
  glDisable(GL_SCISSOR_TEST);
  glBlitNamedFramebuffer(targets_.color(), framebuffer, 0, 0, static_cast<GLint>(from.width),
                         static_cast<GLint>(from.height), 0, height, width, 0, GL_COLOR_BUFFER_BIT,
                         same ? GL_NEAREST : GL_LINEAR);
  errors_.check("showing a picture");
}

}  // namespace cairn::viewer
