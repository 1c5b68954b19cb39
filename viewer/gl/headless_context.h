// An OpenGL context without a window or a screen.
#pragma once

namespace cairn::viewer {

/// OpenGL 4.5 core on the surfaceless platform of EGL, current on the thread that made it until it
/// is destroyed there. It has no framebuffer of its own. EGL's display, which all such contexts of
/// a process share, stays open to its end.
class HeadlessContext {
 public:
  /// Throws Error (kSystem) that says what is missing and names `--mode cpu`.
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

 private:
  void close();

  void* display_ = nullptr;  ///< EGLDisplay
  void* context_ = nullptr;  ///< EGLContext
};

/// Throws Error (kSystem), as above, unless the context that is current on this thread is OpenGL
/// 4.5 or later.
void require_gl_45();

}  // namespace cairn::viewer
