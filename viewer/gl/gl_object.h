// Owners of OpenGL objects. The context that an object was made on must be current where it is
// made, used and destroyed.
#pragma once

#include <epoxy/gl.h>

#include <utility>

namespace cairn::viewer::gl {

/// Owns the name of one object; 0 stands for none.
template <typename Kind>
class Object {
 public:
  Object() = default;
  explicit Object(GLuint name) : name_(name) {}
  Object(Object&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~Object() {
    if (name_ != 0) Kind::destroy(name_);
  }
  GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  GLuint name_ = 0;
};

struct BufferKind {
  static void destroy(GLuint name) { glDeleteBuffers(1, &name); }
};
struct TextureKind {
  static void destroy(GLuint name) { glDeleteTextures(1, &name); }
};
struct FramebufferKind {
  static void destroy(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct VertexArrayKind {
  static void destroy(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct QueryKind {
  static void destroy(GLuint name) { glDeleteQueries(1, &name); }
};
struct ShaderKind {
  static void destroy(GLuint name) { glDeleteShader(name); }
};
struct ProgramKind {
  static void destroy(GLuint name) { glDeleteProgram(name); }
};

using Buffer = Object<BufferKind>;
using Texture = Object<TextureKind>;
using Framebuffer = Object<FramebufferKind>;
using VertexArray = Object<VertexArrayKind>;
using Query = Object<QueryKind>;
using Shader = Object<ShaderKind>;
using Program = Object<ProgramKind>;

inline Buffer make_buffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return Buffer(name);
}
inline Texture make_texture(GLenum target) {
  GLuint name = 0;
  glCreateTextures(target, 1, &name);
  return Texture(name);
}
inline Framebuffer make_framebuffer() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  return Framebuffer(name);
}
inline VertexArray make_vertex_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return VertexArray(name);
}
inline Query make_query() {
  GLuint name = 0;
  glCreateQueries(GL_ANY_SAMPLES_PASSED, 1, &name);
  return Query(name);
}

}  // namespace cairn::viewer::gl
