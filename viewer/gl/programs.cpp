#include "viewer/gl/programs.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "formats/error.h"
#include "viewer/gl/point_store.h"
#include "viewer/gl/shaders.h"
#include "viewer/renderer.h"

namespace cairn::viewer::gl {
namespace {

std::string head_of(std::string_view stage, std::string_view names) {
  std::string head = fmt::format(
      "#version 450 core\n#define {}\n"
      "const float kAmbient = {:#.9g};\nconst float kEyeDomeStrength = {:#.9g};\n"
      "const int kEyeDomePixels = {};\nconst float kBlendRadii = {:#.9g};\n"
      "const float kMinPixelRadius = {:#.9g};\nconst int GROUPS = {};\n",
      stage, shading::kAmbient, shading::kEyeDomeStrength, shading::kEyeDomePixels,
      shading::kBlendRadii, shading::kMinPixelRadius, PointStore::kGroups);
  std::istringstream words{std::string(names)};
  for (std::string name; words >> name;) head += "#define " + name + "\n";
  return head.append(shader::kHead);
}

/// `read`: glGetShaderInfoLog or glGetProgramInfoLog.
template <typename Read>
[[noreturn]] void refuse(Read read, GLuint name, std::string_view names) {
  std::string log(2000, '\0');
  GLsizei length = 0;
  read(name, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(std::min(log.find('\n'), static_cast<std::size_t>(std::max(length, 0))));
  throw formats::Error(
      formats::ErrorKind::kSystem,
      {.what =
           fmt::format("the OpenGL driver refuses the shaders '{}'; --mode cpu needs none", names),
       .found = log});
}

Shader compile(GLenum stage, std::string_view source, std::string_view names) {
  const std::string head = head_of(stage == GL_VERTEX_SHADER ? "VERTEX" : "FRAGMENT", names);
  Shader shader(glCreateShader(stage));
  const GLchar* texts[] = {head.data(), source.data()};
  const GLint lengths[] = {static_cast<GLint>(head.size()), static_cast<GLint>(source.size())};
  glShaderSource(shader.name(), 2, texts, lengths);
  glCompileShader(shader.name());
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &compiled);
  if (compiled != GL_TRUE) refuse(glGetShaderInfoLog, shader.name(), names);
  return shader;
}

Program link(std::string_view source, std::string_view names) {
  const Shader vertex = compile(GL_VERTEX_SHADER, source, names);
  const Shader fragment = compile(GL_FRAGMENT_SHADER, source, names);
  Program program(glCreateProgram());
  glAttachShader(program.name(), vertex.name());
  glAttachShader(program.name(), fragment.name());
  glLinkProgram(program.name());
  GLint linked = GL_FALSE;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  if (linked != GL_TRUE) refuse(glGetProgramInfoLog, program.name(), names);
  return program;
}

}  // namespace

void Programs::use(std::string_view source, std::string_view names) {
  Program& program = programs_[{source, std::string(names)}];
  if (!program) program = link(source, names);
  glUseProgram(program.name());
}

}  // namespace cairn::viewer::gl
