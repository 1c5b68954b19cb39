// A window of the desktop with an OpenGL 4.5 context, and what mouse and keyboard did in it.
#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "viewer/camera.h"

struct GLFWwindow;

namespace cairn::viewer {

/// Its context is current on the thread that made it, which must be the main thread, until it is
/// destroyed there. At most one lives at a time in a process.
class Window {
 public:
  /// `size`: of its picture, as far as the screen has room. Throws Error (kSystem) that says in
  /// GLFW's words what is missing and names `cairn render --mode cpu`.
  Window(PictureSize size, const std::string& title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  GLFWwindow* handle() const { return window_; }
  /// Pixels of its picture; none while it is hidden as an icon.
  PictureSize size() const;
  /// How large text should be, times that of a plain screen.
  float content_scale() const;
  bool should_close() const;
  void close();

  /// Takes what has happened; waits for it up to this many seconds, if above 0.
  void take_events(double wait_s);
  /// From any thread: what waits in take_events returns.
  static void wake();
  /// Shows what was drawn.
  void show();

  /// Whether something happened since the last call that a new frame may answer to.
  bool take_change();
  /// Keys that were pressed since the last call, as GLFW numbers them, in order.
  std::vector<int> take_keys();
  /// Steps of the wheel since the last call, away from the user.
  double take_wheel();
  /// Where the mouse is: pixels of the picture, from the left and from the top.
  glm::dvec2 pointer() const;
  bool button_down(int button) const;
  bool key_down(int key) const;

 private:
  static Window& of(GLFWwindow* window);
  void watch();

  GLFWwindow* window_ = nullptr;
  bool change_ = true;
  std::vector<int> keys_;
  double wheel_ = 0;
};

}  // namespace cairn::viewer
