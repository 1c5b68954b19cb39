// Speed of the OpenGL renderer against the least that any program can do with the same points on
// the same driver: one glDrawArrays over one buffer of positions and colors with a minimal shader,
// into a target of the same kind. Both are timed in turn, in one run, each until the driver is
// done; medians are compared. Items are points.
#include <benchmark/benchmark.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "viewer/gl/gl_object.h"
#include "viewer/gl/gl_renderer.h"
#include "viewer/gl/headless_context.h"

namespace {

using namespace cairn::viewer;

constexpr std::uint32_t kItems = 40;
constexpr std::uint32_t kItemPoints = 50000;
constexpr PictureSize kSize{1280, 720};
constexpr int kRepetitions = 9;

constexpr const char* kVertex = R"glsl(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 color;
layout(location = 0) uniform mat4 transform;
flat out vec4 shade;
void main() {
  gl_Position = transform * vec4(position, 1.0);
  shade = color;
}
)glsl";
constexpr const char* kFragment = R"glsl(#version 450 core
flat in vec4 shade;
layout(location = 0) out vec4 result;
void main() { result = shade; }
)glsl";

/// What is seen by a camera at the origin that looks along y, from the eye: a wavy surface that
/// fills the picture.
NodePoints surface(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(-1, 1);
  NodePoints points;
  for (std::uint32_t i = 0; i < kItemPoints; ++i) {
    const float depth = 10 + 0.2f * unit(random);
    points.position.emplace_back(8 * unit(random), depth, 4.5f * unit(random));
    points.color.push_back(0xff000000 | (random() & 0xffffff));
    points.normal.push_back(pack_normal({0, -1, 0}));
  }
  return points;
}

/// The camera above, with the depth that the renderer has.
View view_along_y() {
  Camera camera;
  camera.target = {0, 1, 0};
  return {camera, kSize, 0.1};
}
std::array<GLfloat, 16> transform_of(const View& view) {
  const auto focal = static_cast<float>(view.focal_pixels());
  const float x = 2 * focal / static_cast<float>(kSize.width);
  const float z = 2 * focal / static_cast<float>(kSize.height);
  const auto near = static_cast<float>(view.near());
  return {x, 0, 0, 0, 0, 0, 0, 1, 0, z, 0, 0, 0, 0, near, 0};  // columns
}

/// One buffer, one call.
class PlainCall {
 public:
  PlainCall(const std::vector<NodePoints>& slots, const View& view) {
    std::vector<glm::vec3> position;
    std::vector<std::uint32_t> color;
    for (const NodePoints& slot : slots) {
      position.insert(position.end(), slot.position.begin(), slot.position.end());
      color.insert(color.end(), slot.color.begin(), slot.color.end());
    }
    count_ = static_cast<GLsizei>(position.size());
    add(0, positions_, position.data(), 12, 3, GL_FLOAT);
    add(1, colors_, color.data(), 4, 4, GL_UNSIGNED_BYTE);
    link(view);
    glTextureStorage2D(color_.name(), 1, GL_RGBA8, kSize.width, kSize.height);
    glTextureStorage2D(depth_.name(), 1, GL_DEPTH_COMPONENT32F, kSize.width, kSize.height);
    glNamedFramebufferTexture(target_.name(), GL_COLOR_ATTACHMENT0, color_.name(), 0);
    glNamedFramebufferTexture(target_.name(), GL_DEPTH_ATTACHMENT, depth_.name(), 0);
  }

  void draw() const {
    constexpr std::array<GLfloat, 4> kNone{};
    glBindFramebuffer(GL_FRAMEBUFFER, target_.name());
    glClearNamedFramebufferfv(target_.name(), GL_COLOR, 0, kNone.data());
    glClearNamedFramebufferfv(target_.name(), GL_DEPTH, 0, kNone.data());
    glViewport(0, 0, kSize.width, kSize.height);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDisable(GL_PROGRAM_POINT_SIZE);
    glPointSize(1);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glUseProgram(program_.name());
    glBindVertexArray(array_.name());
    glDrawArrays(GL_POINTS, 0, count_);
  }
  std::size_t covered_pixels() const {
    std::vector<float> depth(std::size_t{kSize.width} * kSize.height);
    glBindFramebuffer(GL_FRAMEBUFFER, target_.name());
    glReadPixels(0, 0, kSize.width, kSize.height, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
    return depth.size() - static_cast<std::size_t>(std::count(depth.begin(), depth.end(), 0.0f));
  }

 private:
  void add(GLuint index, const gl::Buffer& buffer, const void* data, GLsizei bytes,
           GLint components, GLenum type) {
    glNamedBufferStorage(buffer.name(), GLsizeiptr{count_} * bytes, data, 0);
    glVertexArrayVertexBuffer(array_.name(), index, buffer.name(), 0, bytes);
    glEnableVertexArrayAttrib(array_.name(), index);
    glVertexArrayAttribFormat(array_.name(), index, components, type, type == GL_UNSIGNED_BYTE, 0);
    glVertexArrayAttribBinding(array_.name(), index, index);
  }
  void link(const View& view) {
    const gl::Shader vertex(glCreateShader(GL_VERTEX_SHADER));
    const gl::Shader fragment(glCreateShader(GL_FRAGMENT_SHADER));
    glShaderSource(vertex.name(), 1, &kVertex, nullptr);
    glShaderSource(fragment.name(), 1, &kFragment, nullptr);
    for (const GLuint shader : {vertex.name(), fragment.name()}) {
      glCompileShader(shader);
      glAttachShader(program_.name(), shader);
    }
    glLinkProgram(program_.name());
    glProgramUniformMatrix4fv(program_.name(), 0, 1, GL_FALSE, transform_of(view).data());
  }

  GLsizei count_ = 0;
  gl::VertexArray array_ = gl::make_vertex_array();
  gl::Buffer positions_ = gl::make_buffer(), colors_ = gl::make_buffer();
  gl::Program program_{glCreateProgram()};
  gl::Texture color_ = gl::make_texture(GL_TEXTURE_2D), depth_ = gl::make_texture(GL_TEXTURE_2D);
  gl::Framebuffer target_ = gl::make_framebuffer();
};

double seconds_of(const std::function<void()>& draw) {
  const auto start = std::chrono::steady_clock::now();
  draw();
  glFinish();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::size_t covered_pixels(const Picture& picture) {
  std::size_t covered = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
    covered += std::equal(std::begin(shading::kBackground), std::end(shading::kBackground),
                          &picture.rgb[i])
                   ? 0
                   : 1;
  return covered;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Times a frame and the plain call in turn; tells the frame's points/s and its share of the plain
/// call's.
void compare(benchmark::State& state, const FramePlan& plan) {
  const HeadlessContext context;
  const View view = view_along_y();
  std::mt19937 random(1);
  std::vector<NodePoints> slots;
  const ColumnSet columns = columns_of(plan);
  GlRenderer renderer({columns, kItems, kItemPoints});
  Frame frame{view, plan, {}};
  for (std::uint32_t slot = 0; slot < kItems; ++slot) {
    slots.push_back(surface(random));
    if (!columns.normal) slots.back().normal.clear();
    renderer.upload(slot, slots.back().columns());
    frame.items.push_back({.slot = slot, .count = kItemPoints, .region = slot});
  }
  const PlainCall plain(slots, view);
  constexpr double kPoints = double{kItems} * kItemPoints;
  std::vector<double> ours, least;
  for (auto _ : state) {
    least.push_back(seconds_of([&] { plain.draw(); }));
    ours.push_back(seconds_of([&] { renderer.draw(frame); }));
    state.SetIterationTime(ours.back());
  }
  const auto covered = static_cast<double>(covered_pixels(renderer.picture()));
  if (std::abs(covered / static_cast<double>(plain.covered_pixels()) - 1) > 0.01)
    state.SkipWithError("the two draw different pictures");
  state.counters["points/s"] = kPoints / median(ours);
  state.counters["plain points/s"] = kPoints / median(least);
  state.counters["share of plain"] = median(least) / median(ours);
  state.SetLabel(reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
}

void BM_Points(benchmark::State& state) {
  compare(state, {.primitive = Primitive::kPoints, .color = ColorSource::kColor});
}
BENCHMARK(BM_Points)->UseManualTime()->Iterations(kRepetitions)->Unit(benchmark::kMillisecond);

void BM_LitPoints(benchmark::State& state) {
  compare(state, {.primitive = Primitive::kPoints, .color = ColorSource::kColor, .lighting = true});
}
BENCHMARK(BM_LitPoints)->UseManualTime()->Iterations(kRepetitions)->Unit(benchmark::kMillisecond);

/// Every item inside a query of its own.
void BM_WatchedPoints(benchmark::State& state) {
  compare(
      state,
      {.primitive = Primitive::kPoints, .color = ColorSource::kColor, .occlusion_queries = true});
}
BENCHMARK(BM_WatchedPoints)
    ->UseManualTime()
    ->Iterations(kRepetitions)
    ->Unit(benchmark::kMillisecond);

}  // namespace
