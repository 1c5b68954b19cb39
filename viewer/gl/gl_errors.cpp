#include "viewer/gl/gl_errors.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <utility>

#include "formats/error.h"

namespace cairn::viewer::gl {
namespace {

#ifdef NDEBUG
constexpr bool kWithMessages = false;
#else
constexpr bool kWithMessages = true;
#endif
/// The version that messages are part of.
constexpr int kMessageVersion = 43;

bool keeps_messages() { return kWithMessages && epoxy_gl_version() >= kMessageVersion; }

/// Keeps the first message since the last check.
void keep_message(GLenum, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* message,
                  const void* kept) {
  auto& text = *static_cast<std::string*>(const_cast<void*>(kept));
  if (type == GL_DEBUG_TYPE_ERROR && text.empty() && length > 0)
    text.assign(message, static_cast<std::size_t>(length));
}

}  // namespace

ErrorWatch::ErrorWatch() {
  if (!keeps_messages()) return;
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageCallback(keep_message, message_.get());
}

ErrorWatch::~ErrorWatch() {
  if (keeps_messages()) glDebugMessageCallback(nullptr, nullptr);
}

void ErrorWatch::check(std::string_view doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  // A driver may keep several, and none is left for the next caller; a lost context tells errors
  // without end.
  for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) {
  }
  std::string message = std::exchange(*message_, {});
  if (error == GL_OUT_OF_MEMORY)
    throw formats::Error(
        formats::ErrorKind::kSystem,
        {.what = fmt::format("OpenGL is out of memory, {}", doing), .found = std::move(message)});
  if (message.empty()) message = fmt::format("error {:#06x}", error);
  throw formats::Error(
      formats::ErrorKind::kInvariant,
      {.what = fmt::format("OpenGL failed, {}", doing), .found = std::move(message)});
}

}  // namespace cairn::viewer::gl
