#include "viewer/window/window.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// With GLFW's own words for what went wrong last.
[[noreturn]] void refuse(const char* what) {
  const char* words = nullptr;
  glfwGetError(&words);
  throw formats::Error(
      formats::ErrorKind::kSystem,
      {.what = std::string(what) + " (" + (words != nullptr ? words : "no reason is told") +
               "); cairn render --mode cpu draws without a display or OpenGL"});
}

GLFWwindow* open(PictureSize size, const std::string& title) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
#ifndef NDEBUG
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, GLFW_TRUE);
#endif
  // Points are drawn into targets of their own.
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "cairn");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "cairn");
  return glfwCreateWindow(static_cast<int>(size.width), static_cast<int>(size.height),
                          title.c_str(), nullptr, nullptr);
}

}  // namespace

Window::Window(PictureSize size, const std::string& title) {
  if (glfwInit() != GLFW_TRUE) refuse("no window can be opened");
  window_ = open(size, title);
  if (window_ == nullptr) {
    try {
      refuse("no window with OpenGL 4.5 can be opened");
    } catch (...) {
      glfwTerminate();
      throw;
    }
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  watch();
}

Window::~Window() {
  glfwDestroyWindow(window_);
  glfwTerminate();
}

Window& Window::of(GLFWwindow* window) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

void Window::watch() {
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) {
    of(w).change_ = true;
    if (action == GLFW_PRESS) of(w).keys_.push_back(key);
  });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double steps) {
    of(w).change_ = true;
    of(w).wheel_ += steps;
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int, int, int) { of(w).change_ = true; });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double, double) { of(w).change_ = true; });
  glfwSetCursorEnterCallback(window_, [](GLFWwindow* w, int) { of(w).change_ = true; });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int) { of(w).change_ = true; });
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w).change_ = true; });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int, int) { of(w).change_ = true; });
}

PictureSize Window::size() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return {static_cast<std::uint32_t>(std::max(width, 0)),
          static_cast<std::uint32_t>(std::max(height, 0))};
}

float Window::content_scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  return std::clamp(std::min(x, y), 1.0f, 4.0f);
}

bool Window::should_close() const { return glfwWindowShouldClose(window_) == GLFW_TRUE; }
void Window::close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }

void Window::take_events(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
}

void Window::wake() { glfwPostEmptyEvent(); }
void Window::show() { glfwSwapBuffers(window_); }
bool Window::take_change() { return std::exchange(change_, false); }
std::vector<int> Window::take_keys() { return std::exchange(keys_, {}); }
double Window::take_wheel() { return std::exchange(wheel_, 0); }

glm::dvec2 Window::pointer() const {
  glm::dvec2 at(0);
  glfwGetCursorPos(window_, &at.x, &at.y);
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  const PictureSize pixels = size();
  if (width <= 0 || height <= 0) return at;
  return at * glm::dvec2(pixels.width, pixels.height) / glm::dvec2(width, height);
}

bool Window::button_down(int button) const {
  return glfwGetMouseButton(window_, button) == GLFW_PRESS;
}
bool Window::key_down(int key) const { return glfwGetKey(window_, key) == GLFW_PRESS; }

}  // namespace cairn::viewer
