#include "viewer/gl/headless_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <string>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

constexpr int kVersion = 45;  ///< as epoxy_gl_version tells it

[[noreturn]] void refuse(std::string what, std::string found, std::string expected) {
  throw formats::Error(formats::ErrorKind::kSystem,
                       {.what = "cannot draw with OpenGL: " + std::move(what),
                        .found = std::move(found),
                        .expected = std::move(expected) + "; --mode cpu needs none"});
}

/// epoxy ends the process if a function is called that is not there: extensions are asked first,
/// always.
bool has_extension(const char* extensions, const char* name) {
  return extensions != nullptr && epoxy_extension_in_string(extensions, name);
}

std::string hex(EGLint error) { return fmt::format("EGL error {:#06x}", error); }

EGLDisplay open_display() {
  constexpr const char* kSurfaceless = "EGL_MESA_platform_surfaceless";
  if (!epoxy_has_egl()) refuse("no EGL on this machine", "", "libEGL.so.1");
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!has_extension(extensions, "EGL_EXT_platform_base") ||
      !has_extension(extensions, kSurfaceless))
    refuse("EGL cannot do without a screen", "no surfaceless platform", kSurfaceless);
  const EGLDisplay display =
      eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr))
    refuse("EGL does not start without a screen", hex(eglGetError()), "a driver");
  return display;
}

EGLContext make_context(EGLDisplay display, bool latest) {
#ifdef NDEBUG
  constexpr EGLint kDebug = EGL_FALSE;
#else
  constexpr EGLint kDebug = EGL_TRUE;
#endif
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                            kVersion / 10,
                            EGL_CONTEXT_MINOR_VERSION,
                            kVersion % 10,
                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                            EGL_CONTEXT_OPENGL_DEBUG,
                            kDebug,
                            EGL_NONE};
  const EGLint any[] = {EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, latest ? version : any);
}

bool make_current(EGLDisplay display, EGLContext context) {
  return context != EGL_NO_CONTEXT &&
         eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context);
}

void require_extensions(EGLDisplay display) {
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  for (const char* name :
       {"EGL_KHR_create_context", "EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"})
    if (!has_extension(extensions, name))
      refuse("EGL cannot do without a window", "a driver without it", name);
}

/// The version that the driver gives where no version is asked for, in words.
std::string best_version(EGLDisplay display) {
  const EGLContext context = make_context(display, false);
  std::string version = "none at all";
  if (make_current(display, context)) {
    const int found = epoxy_gl_version();
    version = fmt::format("{}.{}", found / 10, found % 10);
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
  return version;
}

}  // namespace

HeadlessContext::HeadlessContext() : display_(open_display()) {
  require_extensions(display_);
  if (!eglBindAPI(EGL_OPENGL_API))
    refuse("EGL has OpenGL ES alone", hex(eglGetError()), "OpenGL 4.5");
  context_ = make_context(display_, true);
  if (!make_current(display_, context_)) {
    close();
    refuse("the driver is too old", "version " + best_version(display_), "4.5, core profile");
  }
}

HeadlessContext::~HeadlessContext() { close(); }

void HeadlessContext::close() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
}

void require_gl_45() {
  const int version = epoxy_gl_version();
  if (version < kVersion)
    refuse("the driver is too old", fmt::format("version {}.{}", version / 10, version % 10),
           "4.5, core profile");
}

}  // namespace cairn::viewer
