#include "viewer/window/hand.h"

#include <GLFW/glfw3.h>

#include <utility>

namespace cairn::viewer {

MouseMove Hand::take_mouse() {
  const glm::dvec2 to = window_.pointer();
  MouseMove move{.from = std::exchange(pointer_, to), .to = to, .wheel = window_.take_wheel()};
  const bool left = window_.button_down(GLFW_MOUSE_BUTTON_LEFT);
  const bool other =
      window_.button_down(GLFW_MOUSE_BUTTON_RIGHT) || window_.button_down(GLFW_MOUSE_BUTTON_MIDDLE);
  const bool held_before = std::exchange(held_, left || other);
  if (!held_ || !held_before) return move;
  move.shifts = other || shift();
  move.turns = !move.shifts;
  return move;
}

glm::dvec3 Hand::along(bool in_flight) const {
  const auto pushed = [&](int key, int letter) {
    return window_.key_down(key) || (in_flight && window_.key_down(letter)) ? 1.0 : 0.0;
  };
  return {pushed(GLFW_KEY_RIGHT, GLFW_KEY_D) - pushed(GLFW_KEY_LEFT, GLFW_KEY_A),
          pushed(GLFW_KEY_PAGE_UP, GLFW_KEY_E) - pushed(GLFW_KEY_PAGE_DOWN, GLFW_KEY_C),
          pushed(GLFW_KEY_UP, GLFW_KEY_W) - pushed(GLFW_KEY_DOWN, GLFW_KEY_S)};
}

bool Hand::shift() const {
  return window_.key_down(GLFW_KEY_LEFT_SHIFT) || window_.key_down(GLFW_KEY_RIGHT_SHIFT);
}

}  // namespace cairn::viewer
